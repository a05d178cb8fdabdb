//! The kernel: every vertex of every history connected to a tile of receivers.
//!
//! One estimator for illuminance and luminance; see the equations in [`super`]. Loop order is tile -> history ->
//! vertex: the tile stays in the first cache, a history's vertices are summed in f32 (one channel or three), and
//! its total goes once, in f64, into the score. Sums run in the order of the histories, so scores do not depend on
//! how histories are split or by whom tiles are computed. Plain f32 operations without contraction give the same
//! bits whatever the width of the vectors they are compiled to.

use super::receiver::Receiver;
use super::trajectory::Vertex;
use crate::math::{PI, Vec3};
use crate::photometry::Colour;
use crate::scene::Scene;
use std::ops::Range;

/// Receivers of one tile.
pub const TILE: usize = 256;

/// A vertex as the kernel wants it.
#[derive(Clone, Copy, Debug)]
struct Connector {
    position: Vec3,
    lifted: Vec3,
    normal: Vec3,
    /// W_n rho / pi of a Lambert vertex \[lm/sr\].
    intensity: [f32; 3],
    /// The vertex itself where the law of reflection depends on direction.
    glossy: Option<Vertex>,
}

/// The vertices of many histories, ready to be connected.
#[derive(Debug, Default)]
pub struct Connectors {
    all: Vec<Connector>,
    /// End of each history in `all`.
    ends: Vec<usize>,
}

impl Connectors {
    /// Appends the vertices of the next history; those whose order lies outside `orders` are left out.
    pub fn push(&mut self, scene: &Scene, history: &[Vertex], orders: &Range<u32>) {
        let counted = history.iter().filter(|v| orders.contains(&v.order));
        self.all.extend(counted.map(|v| connector(scene, v)));
        self.ends.push(self.all.len());
    }

    /// Number of histories, those without vertices included.
    pub fn histories(&self) -> usize {
        self.ends.len()
    }

    /// Number of vertices.
    pub fn vertices(&self) -> usize {
        self.all.len()
    }

    fn iter(&self) -> impl Iterator<Item = &[Connector]> {
        let mut start = 0;
        self.ends.iter().map(move |&end| &self.all[std::mem::replace(&mut start, end)..end])
    }
}

fn connector(scene: &Scene, v: &Vertex) -> Connector {
    let lambert = scene.surface(v.primitive).reflectance.lambert();
    Connector {
        position: v.position.as_vec3(),
        lifted: scene.geometry.lift(v.position, v.normal).as_vec3(),
        normal: v.normal.as_vec3(),
        intensity: (v.weight * lambert.unwrap_or(Colour::BLACK) / PI).0.map(|c| c as f32),
        glossy: lambert.is_none().then_some(*v),
    }
}

/// What the histories of a batch give one receiver: sums over histories, not yet divided by their number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Connected {
    /// Sum of the totals of all histories.
    pub sum: Colour,
    /// The largest luminous total of a single history.
    pub peak: f64,
}

/// Connects all histories to at most [`TILE`] receivers; entry i belongs to `receivers[i]`.
///
/// With `channels` = 1 the first channel stands for all three.
pub fn connect(scene: &Scene, histories: &Connectors, receivers: &[Receiver], channels: usize) -> Vec<Connected> {
    match channels {
        1 => connect_channels::<1>(scene, histories, receivers),
        _ => connect_channels::<3>(scene, histories, receivers),
    }
}

fn connect_channels<const C: usize>(scene: &Scene, histories: &Connectors, receivers: &[Receiver]) -> Vec<Connected> {
    let tile = Tile::new(scene, receivers);
    let mut connected = vec![Connected::default(); receivers.len()];
    let mut factors = [0f32; TILE];
    let mut totals = [[0f32; TILE]; C];
    for history in histories.iter().filter(|h| !h.is_empty()) {
        totals.iter_mut().for_each(|t| t[..receivers.len()].fill(0.0));
        for vertex in history {
            let factors = &mut factors[..receivers.len()];
            tile.factors(vertex, factors);
            scene.geometry.shadow(vertex.lifted, &tile.lifted, factors);
            if vertex.glossy.is_none() && tile.all_constant {
                add_constant(&mut totals, &vertex.intensity, factors);
            } else {
                tile.add_varying(scene, &mut totals, vertex, factors);
            }
        }
        tile.add_totals(&totals, &mut connected);
    }
    connected
}

/// Adds `intensity` x factor to every receiver.
fn add_constant<const C: usize>(totals: &mut [[f32; TILE]; C], intensity: &[f32; 3], factors: &[f32]) {
    for (total, &intensity) in totals.iter_mut().zip(intensity) {
        for (sum, &factor) in total.iter_mut().zip(factors) {
            *sum += intensity * factor;
        }
    }
}

/// Receivers as a structure of arrays.
struct Tile<'a> {
    receivers: &'a [Receiver],
    x: [f32; TILE],
    y: [f32; TILE],
    z: [f32; TILE],
    normal_x: [f32; TILE],
    normal_y: [f32; TILE],
    normal_z: [f32; TILE],
    lifted: Vec<Vec3>,
    /// Response of each receiver where it does not depend on direction.
    constant: Vec<Option<Colour>>,
    all_constant: bool,
}

impl<'a> Tile<'a> {
    fn new(scene: &Scene, receivers: &'a [Receiver]) -> Self {
        assert!(receivers.len() <= TILE, "a tile holds {TILE} receivers");
        let constant: Vec<_> = receivers.iter().map(|r| r.response.constant(scene)).collect();
        let column = |f: &dyn Fn(&Receiver) -> f64| {
            let mut column = [0f32; TILE];
            column.iter_mut().zip(receivers).for_each(|(c, r)| *c = f(r) as f32);
            column
        };
        Tile {
            receivers,
            x: column(&|r| r.position.x),
            y: column(&|r| r.position.y),
            z: column(&|r| r.position.z),
            normal_x: column(&|r| r.normal.x),
            normal_y: column(&|r| r.normal.y),
            normal_z: column(&|r| r.normal.z),
            lifted: receivers.iter().map(|r| scene.geometry.lift(r.position, r.normal).as_vec3()).collect(),
            all_constant: constant.iter().all(Option::is_some),
            constant,
        }
    }

    /// Geometric factors G without visibility; 0 where vertex or receiver faces away \[1/m2\].
    fn factors(&self, vertex: &Connector, factors: &mut [f32]) {
        let (p, n) = (vertex.position, vertex.normal);
        for i in 0..factors.len().min(TILE) {
            let (x, y, z) = (self.x[i] - p.x, self.y[i] - p.y, self.z[i] - p.z);
            let leaving = (n.x * x + n.y * y + n.z * z).max(0.0);
            let arriving = (-(self.normal_x[i] * x + self.normal_y[i] * y + self.normal_z[i] * z)).max(0.0);
            // A receiver at the vertex itself has no direction and gets nothing, not NaN.
            let inverse = 1.0 / (x * x + y * y + z * z).max(1e-30);
            factors[i] = (leaving * inverse) * (arriving * inverse);
        }
    }

    /// Adds what needs the direction of each connection, at the vertex or at the receiver.
    fn add_varying<const C: usize>(
        &self,
        scene: &Scene,
        totals: &mut [[f32; TILE]; C],
        vertex: &Connector,
        factors: &[f32],
    ) {
        for (i, &factor) in factors.iter().enumerate().filter(|(_, f)| **f != 0.0) {
            let receiver = &self.receivers[i];
            let w = (receiver.position - vertex.position.as_dvec3()).normalize();
            let mut value = vertex.intensity;
            if let Some(v) = &vertex.glossy {
                let sigma = scene.surface(v.primitive).reflectance.evaluate(v.normal, v.w_in, w);
                value = (v.weight * sigma).0.map(|c| c as f32);
            }
            if self.constant[i].is_none() {
                let response = receiver.response.to(scene, receiver.normal, w);
                value = std::array::from_fn(|c| value[c] * response.0[c] as f32);
            }
            for (total, &v) in totals.iter_mut().zip(&value) {
                total[i] += v * factor;
            }
        }
    }

    /// Adds the totals of one history to the scores.
    fn add_totals<const C: usize>(&self, totals: &[[f32; TILE]; C], connected: &mut [Connected]) {
        for (i, into) in connected.iter_mut().enumerate() {
            let total = Colour(std::array::from_fn(|c| f64::from(totals[c.min(C - 1)][i])));
            let total = total * self.constant[i].unwrap_or(Colour::WHITE);
            into.sum += total;
            into.peak = into.peak.max(total.luminance());
        }
    }
}
