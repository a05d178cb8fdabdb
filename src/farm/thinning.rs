//! Which vertices of a batch are connected: a few that stand for many.
//!
//! To trace a trajectory costs as much as to connect a vertex to some hundred receivers. So where receivers are many,
//! more trajectories are traced than connected: `thinning` of them for each history. Their vertices are put in an order in which
//! neighbours with like normals follow each other, and every F/K lumens of reflected flux one is chosen, from a random start
//! on, with F the flux of all and K the number wanted. A vertex i that reflects F_i is chosen F_i K/F times on average and
//! its weight is divided by that, so every sum over vertices keeps its mean; and what is chosen is spread over the
//! surfaces as the light is, which takes most of the variance that a choice at random would add (docs/method.md, section 2).
//!
//! The choice never looks at a receiver.

use crate::math::DVec3;
use crate::random::Generator;
use crate::random::systematic::Systematic;
use crate::scene::Scene;
use crate::transport::connection::{Connectors, dealing};
use crate::transport::pool::Pool;
use crate::transport::trajectory::Vertex;
use rayon::prelude::*;

/// Vertices from which is chosen at once, or a little more: a batch of trajectories that hardly end must not fill the memory.
const TOGETHER: usize = 1 << 20;
/// Steps along an axis of the space in which vertices are sorted: 2^10.
const STEPS: f64 = 1024.0;
/// Bits of the number of a vertex below its key.
const NUMBER: u32 = 30;

/// What receivers are connected to in a batch.
#[derive(Debug)]
pub struct Histories {
    /// Vertices that every tile may be connected to.
    pub connectors: Connectors,
    /// More of them, from which a tile chooses as many; none where all are connected.
    pub pool: Option<Pool>,
}

/// The vertices of a batch on their way through the choice.
pub struct Thinning<'a> {
    scene: &'a Scene,
    thinning: usize,
    /// Vertices that are kept for each that a tile is connected to.
    kept: usize,
    rng: Generator,
    /// Not chosen from yet.
    waiting: Vec<Vertex>,
    chosen: Vec<Vertex>,
}

impl<'a> Thinning<'a> {
    /// One of `thinning` vertices will be chosen, and `kept` times as many kept to choose from, from random starts drawn from `rng`.
    pub fn new(scene: &'a Scene, (thinning, kept): (u64, u64), rng: Generator) -> Self {
        Thinning {
            scene,
            thinning: thinning as usize,
            kept: kept as usize,
            rng,
            waiting: Vec::new(),
            chosen: Vec::new(),
        }
    }

    /// Takes in the vertices of the next trajectories.
    pub fn take(&mut self, vertices: impl IntoIterator<Item = Vertex>) {
        self.waiting.extend(vertices);
        if self.waiting.len() >= TOGETHER {
            self.choose();
        }
    }

    /// What stands for all that was taken in, as so many `histories`.
    pub fn finish(mut self, histories: u64) -> Histories {
        self.choose();
        let (kept, histories) = (self.kept, histories as usize);
        let offset = if kept > 1 { self.rng.below(kept as u32) as usize } else { 0 };
        let heavier = |v: &Vertex| Vertex { weight: v.weight * kept as f64, ..*v };
        let some: Vec<Vertex> = self.chosen.iter().skip(offset).step_by(kept).map(heavier).collect();
        let mut connectors = Connectors::default();
        for first in dealing(histories) {
            // In turn, so that each history holds vertices from everywhere, and so do the few that share a continuation.
            let own: Vec<Vertex> = some.iter().skip(first).step_by(histories).copied().collect();
            connectors.push(self.scene, &own);
        }
        Histories { connectors, pool: (kept > 1).then(|| Pool::new(self.scene, &self.chosen)) }
    }

    /// Chooses from those that wait, with the weight of all for which each stands, over `thinning`.
    fn choose(&mut self) {
        let order = order(self.scene, &self.waiting);
        let fluxes: Vec<f64> = order.par_iter().map(|&i| worth(self.scene, &self.waiting[i])).collect();
        let wanted = self.waiting.len().div_ceil(self.thinning) * self.kept;
        let step = fluxes.iter().sum::<f64>() / wanted as f64;
        // Nothing, or less light than a number can tell from nothing.
        if step >= f64::MIN_POSITIVE {
            let mut choice = Systematic::new(step, self.rng.uniform());
            for (i, flux) in order.into_iter().zip(fluxes) {
                let times = choice.times(flux);
                if times > 0 {
                    let vertex = self.waiting[i];
                    let weight = vertex.weight * (step / (flux * self.thinning as f64));
                    self.chosen.extend((0..times).map(|_| Vertex { weight, ..vertex }));
                }
            }
        }
        self.waiting.clear();
    }
}

/// Flux that a vertex reflects, summed over channels, so that none is lost whatever its colour \[lm\].
fn reflected(scene: &Scene, vertex: &Vertex) -> f64 {
    let albedo = scene.reflectance(vertex.primitive, vertex.position).albedo(-vertex.w_in.dot(vertex.normal));
    (vertex.weight * albedo).0.iter().sum()
}

/// What a vertex is chosen in proportion to \[lm\]: the flux that it reflects, but of light that comes beside the openings of daylight
/// about the part that it sends there.
fn worth(scene: &Scene, vertex: &Vertex) -> f64 {
    let shares = scene.openings().iter().map(|opening| opening.share_of(vertex.position, vertex.normal));
    reflected(scene, vertex) * (vertex.emphasis + shares.sum::<f64>()).min(1.0)
}

/// The numbers of the vertices, by the axis nearest to the normal and then along a curve through space (Morton's).
fn order(scene: &Scene, vertices: &[Vertex]) -> Vec<usize> {
    assert!(vertices.len() < 1 << NUMBER, "{} vertices at once", vertices.len());
    // What lies far out on an infinite plane must not stretch the steps.
    let (centre, radius) = scene.geometry.bounding_sphere();
    let reach = if radius > 0.0 { radius } else { f64::MAX };
    let place = |v: &Vertex| v.position.clamp(centre - reach, centre + reach);
    let (low, high) =
        vertices.iter().map(place).fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    let scale = STEPS * (1.0 - 1e-9) / (high - low).max_element().max(f64::MIN_POSITIVE);
    let key = |(i, v): (usize, &Vertex)| {
        let axis = v.normal.abs().max_position();
        let side = 2 * axis as u64 + u64::from(v.normal[axis] < 0.0);
        let [x, y, z] = ((place(v) - low) * scale).to_array().map(|x| spread(x as u64));
        let key = side << 30 | x << 2 | y << 1 | z;
        key << NUMBER | i as u64
    };
    let mut keys: Vec<u64> = vertices.par_iter().enumerate().map(key).collect();
    keys.par_sort_unstable();
    keys.into_iter().map(|key| (key & ((1 << NUMBER) - 1)) as usize).collect()
}

/// The ten lowest bits of `x`, two empty ones after each.
fn spread(x: u64) -> u64 {
    let x = x & 0x3ff;
    let x = (x | x << 16) & 0x0300_00ff;
    let x = (x | x << 8) & 0x0300_f00f;
    let x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}

#[cfg(test)]
mod tests;
