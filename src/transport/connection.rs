//! The kernel: vertices of histories connected to tiles of receivers.
//!
//! One estimator for illuminance and luminance; see the equations in [`super`]. A connection of a vertex x to a
//! receiver r carries the share min(1, b/(G s_x s_r)) of the light on its way, with G the geometric factor, s >= 1
//! the peaks of the two laws of reflection in these directions (1 where they are not peaked) and b the bound of the
//! kernel: so a connection scores at most W b f_x f_r/(s_x s_r), with f/s = rho/pi of matt laws and at most 4/pi of peaked
//! ones. What is left reaches the receiver through [`super::continuation`], whose points
//! are receivers of the same owner. b is infinite for the plain local estimate, and for light that a delta
//! scatterer sent to the vertex: no continuation could find it. How much that is, and how much comes by continuations, is
//! summed beside, for the health of the result.
//!
//! Loop order is tile -> history -> vertex: a tile stays in the first cache, a history's vertices are summed in f32
//! (one channel or three), and its total goes once, in f64, to the owner. Sums run in the order of the histories, so
//! scores do not depend on how histories are split or by whom tiles are computed. Plain f32 operations without
//! contraction give the same bits whatever the width of the vectors they are compiled to.

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
    /// n, the reflections that light scattered here has seen.
    order: u32,
    /// True where the bound does not apply.
    after_delta: bool,
    /// The vertex itself where the law of reflection depends on direction.
    glossy: Option<Vertex>,
}

/// The vertices of many histories, ready to be connected.
#[derive(Debug, Default)]
pub struct Connectors {
    all: Vec<Connector>,
    /// True when some vertex was lit straight by a delta scatterer.
    mirrored: bool,
    /// End of each history in `all`.
    ends: Vec<usize>,
}

impl Connectors {
    /// Appends the vertices of the next history.
    pub fn push(&mut self, scene: &Scene, history: &[Vertex]) {
        self.all.extend(history.iter().map(|v| connector(scene, v)));
        self.mirrored |= history.iter().any(|v| v.after_delta);
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

    fn iter(&self, histories: Range<usize>) -> impl Iterator<Item = &[Connector]> {
        let mut start = histories.start.checked_sub(1).map_or(0, |before| self.ends[before]);
        self.ends[histories].iter().map(move |&end| &self.all[std::mem::replace(&mut start, end)..end])
    }
}

fn connector(scene: &Scene, v: &Vertex) -> Connector {
    let lambert = scene.surface(v.primitive).reflectance.lambert();
    Connector {
        position: v.position.as_vec3(),
        lifted: scene.geometry.lift(v.position, v.normal).as_vec3(),
        normal: v.normal.as_vec3(),
        intensity: (v.weight * lambert.unwrap_or(Colour::BLACK) / PI).0.map(|c| c as f32),
        order: v.order,
        after_delta: v.after_delta,
        glossy: lambert.is_none().then_some(*v),
    }
}

/// A point to which histories are connected on behalf of an owner: the receiver itself, or a point of its continuation.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    /// Number of the owner.
    pub owner: usize,
    /// Where the histories are connected to.
    pub receiver: Receiver,
}

/// What histories give one owner \[lx or cd/m2\]: sums over histories, not yet divided by their number. `mirrored` and `continued` are for
/// [`Connected::unbounded`] alone.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Connected {
    /// Sum of the totals of all histories.
    pub sum: Colour,
    /// The largest luminous total of a single history.
    pub peak: f64,
    /// Where histories met mirrors, the luminous part of `sum` by vertices that a delta scatterer lit straight.
    pub mirrored: f64,
    /// Where histories met mirrors, the luminous part of `sum` that came by continuations.
    pub continued: f64,
    /// The luminous total of every history, where it is wanted.
    pub totals: Option<Vec<f64>>,
}

/// How histories are connected.
#[derive(Clone, Debug)]
pub struct Rule {
    /// b of the bounded kernel \[1/m2\]; infinite for the plain estimate.
    pub bound: f64,
    /// 1: the first channel stands for all three.
    pub channels: usize,
    /// Reflections before the receiver that count: for tests order by order.
    pub orders: Range<u32>,
}

/// Connects the `histories` of `connectors` to all links in `tiles`; entry i of `connected` belongs to owner i, and entry i of
/// `start` is what every history has there before it is connected: direct light at the points of a continuation.
///
/// # Panics
/// With more than [`TILE`] owners.
pub fn connect(
    scene: &Scene,
    connectors: &Connectors,
    histories: Range<usize>,
    tiles: &[&Tile],
    rule: &Rule,
    start: &[Colour],
    connected: &mut [Connected],
) {
    assert!(start.len() == connected.len() && start.len() <= TILE, "at most {TILE} owners");
    match rule.channels {
        1 => connect_channels::<1>(scene, connectors, histories, tiles, rule, start, connected),
        _ => connect_channels::<3>(scene, connectors, histories, tiles, rule, start, connected),
    }
}

fn connect_channels<const C: usize>(
    scene: &Scene,
    connectors: &Connectors,
    histories: Range<usize>,
    tiles: &[&Tile],
    rule: &Rule,
    start: &[Colour],
    connected: &mut [Connected],
) {
    let mut sums = Sums::<C>::new();
    let mut totals = [Colour::BLACK; TILE];
    // Where nothing is known beforehand and nobody counts histories, those without vertices need not be looked at.
    let idle = start.iter().all(|c| c.is_black()) && connected.iter().all(|c| c.totals.is_none());
    for history in connectors.iter(histories).filter(|h| !(idle && h.is_empty())) {
        let totals = &mut totals[..connected.len()];
        totals.copy_from_slice(start);
        for tile in tiles {
            sums.clear(tile.links.len());
            for vertex in history.iter().filter(|v| rule.orders.contains(&(v.order + tile.depth))) {
                tile.add(scene, vertex, rule.bound as f32, &mut sums);
            }
            tile.add_totals(&sums.light, |owner, total| totals[owner] += total);
            if sums.has_mirrored {
                tile.add_totals(&sums.mirrored, |owner, total| connected[owner].mirrored += total.luminance());
            }
            if connectors.mirrored && tile.depth > 0 {
                tile.add_totals(&sums.light, |owner, total| connected[owner].continued += total.luminance());
            }
        }
        if connectors.mirrored {
            connected.iter_mut().zip(start).for_each(|(into, start)| into.continued += start.luminance());
        }
        for (total, into) in totals.iter().zip(&mut *connected) {
            into.add(*total);
        }
    }
}

impl Connected {
    /// About the luminous light that no bound holds, as a sum over histories: of what a mirror sends to the surfaces around
    /// the receiver, the share that continuations bring of all other light.
    pub fn unbounded(&self) -> f64 {
        // Nothing was mirrored where nothing came at all.
        if self.mirrored > 0.0 { self.mirrored * self.continued / self.sum.luminance() } else { 0.0 }
    }

    /// Takes in the total of one history.
    fn add(&mut self, total: Colour) {
        self.sum += total;
        self.peak = self.peak.max(total.luminance());
        if let Some(totals) = &mut self.totals {
            totals.push(total.luminance());
        }
    }
}

/// What one history gives the links of a tile, constant responses left out.
struct Sums<const C: usize> {
    light: [[f32; TILE]; C],
    /// The part of `light` by vertices that a delta scatterer lit straight.
    mirrored: [[f32; TILE]; C],
    has_mirrored: bool,
}

impl<const C: usize> Sums<C> {
    fn new() -> Self {
        Sums { light: [[0.0; TILE]; C], mirrored: [[0.0; TILE]; C], has_mirrored: false }
    }

    /// Back to zero for a tile of `links`.
    fn clear(&mut self, links: usize) {
        self.light.iter_mut().for_each(|s| s[..links].fill(0.0));
        if std::mem::take(&mut self.has_mirrored) {
            self.mirrored.iter_mut().for_each(|s| s[..links].fill(0.0));
        }
    }
}

/// At most [`TILE`] links as a structure of arrays.
#[derive(Debug)]
pub struct Tile {
    links: Vec<Link>,
    /// Reflections between these receivers and their owners.
    depth: u32,
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

impl Tile {
    /// The tile of `links`, at most [`TILE`], which lie `depth` reflections before their owners.
    pub fn new(scene: &Scene, links: Vec<Link>, depth: u32) -> Self {
        assert!(links.len() <= TILE, "a tile holds {TILE} receivers");
        let constant: Vec<_> = links.iter().map(|l| l.receiver.response.constant(scene)).collect();
        let column = |f: &dyn Fn(&Receiver) -> f64| {
            let mut column = [0f32; TILE];
            column.iter_mut().zip(&links).for_each(|(c, l)| *c = f(&l.receiver) as f32);
            column
        };
        let lift = |l: &Link| scene.geometry.lift(l.receiver.position, l.receiver.normal).as_vec3();
        Tile {
            depth,
            x: column(&|r| r.position.x),
            y: column(&|r| r.position.y),
            z: column(&|r| r.position.z),
            normal_x: column(&|r| r.normal.x),
            normal_y: column(&|r| r.normal.y),
            normal_z: column(&|r| r.normal.z),
            lifted: links.iter().map(lift).collect(),
            all_constant: constant.iter().all(Option::is_some),
            constant,
            links,
        }
    }

    /// Adds what `vertex` gives each receiver, a constant response left out.
    fn add<const C: usize>(&self, scene: &Scene, vertex: &Connector, bound: f32, sums: &mut Sums<C>) {
        let mut factors = [0f32; TILE];
        let factors = &mut factors[..self.links.len()];
        self.factors(vertex, factors);
        scene.geometry.shadow(vertex.lifted, &self.lifted, factors);
        if vertex.after_delta {
            sums.has_mirrored = true;
            self.spread(scene, vertex, factors, |factor, _| factor, &mut sums.light);
            self.spread(scene, vertex, factors, |factor, _| factor, &mut sums.mirrored);
        } else {
            self.spread(scene, vertex, factors, |factor, peak| factor.min(bound / peak), &mut sums.light);
        }
    }

    /// Adds to `sums` what `vertex` sends each receiver over the part of its geometric factor that `carried` gives, of the
    /// factor and of the peaks of both laws.
    fn spread<const C: usize>(
        &self,
        scene: &Scene,
        vertex: &Connector,
        factors: &[f32],
        carried: impl Fn(f32, f32) -> f32,
        sums: &mut [[f32; TILE]; C],
    ) {
        if vertex.glossy.is_none() && self.all_constant {
            add_constant(sums, &vertex.intensity, factors, |factor| carried(factor, 1.0));
        } else {
            self.add_varying(scene, vertex, factors, carried, sums);
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
        vertex: &Connector,
        factors: &[f32],
        carried: impl Fn(f32, f32) -> f32,
        sums: &mut [[f32; TILE]; C],
    ) {
        for (i, &factor) in factors.iter().enumerate().filter(|(_, f)| **f != 0.0) {
            let receiver = &self.links[i].receiver;
            let w = (receiver.position - vertex.position.as_dvec3()).normalize();
            let (mut value, mut peak) = (vertex.intensity, 1.0);
            if let Some(v) = &vertex.glossy {
                let reflectance = &scene.surface(v.primitive).reflectance;
                let f = reflectance.evaluate(v.normal, v.w_in, w);
                value = (v.weight * f).0.map(|c| c as f32);
                peak = reflectance.peak(f);
            }
            if self.constant[i].is_none() {
                let (response, of_receiver) = receiver.response.with_peak(scene, receiver.normal, w);
                value = std::array::from_fn(|c| value[c] * response.0[c] as f32);
                peak *= of_receiver;
            }
            let carried = carried(factor, peak as f32);
            for (sum, &v) in sums.iter_mut().zip(&value) {
                sum[i] += v * carried;
            }
        }
    }

    /// Hands the sums of one history to the owners, link by link.
    fn add_totals<const C: usize>(&self, sums: &[[f32; TILE]; C], mut add: impl FnMut(usize, Colour)) {
        for (i, link) in self.links.iter().enumerate() {
            let sum = Colour(std::array::from_fn(|c| f64::from(sums[c.min(C - 1)][i])));
            add(link.owner, sum * self.constant[i].unwrap_or(Colour::WHITE));
        }
    }
}

/// Adds `intensity` x carried factor to every receiver.
fn add_constant<const C: usize>(
    sums: &mut [[f32; TILE]; C],
    intensity: &[f32; 3],
    factors: &[f32],
    carried: impl Fn(f32) -> f32,
) {
    for (sums, &intensity) in sums.iter_mut().zip(intensity) {
        for (sum, &factor) in sums.iter_mut().zip(factors) {
            *sum += intensity * carried(factor);
        }
    }
}
