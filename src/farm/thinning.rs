//! Which vertices of a batch are connected: a few that stand for many.
//!
//! To trace a trajectory costs as much as to connect a vertex to some hundred receivers. So where receivers are many,
//! more trajectories are traced than connected: `thinning` of them for each history. Their vertices are put in an order in which
//! neighbours with like normals follow each other, and every F/K lumens of reflected flux one is chosen, from a random start
//! on, with F the flux of all and K the number wanted. A vertex i that reflects F_i is chosen F_i K/F times on average and
//! its weight is divided by that, so every sum over vertices keeps its mean; and what is chosen is spread over the
//! surfaces as the light is, which takes most of the variance that a choice at random would add (docs/method.md, section 4).
//!
//! The choice never looks at a receiver.

use crate::math::DVec3;
use crate::random::Generator;
use crate::scene::Scene;
use crate::transport::connection::Connectors;
use crate::transport::trajectory::Vertex;
use rayon::prelude::*;

/// Steps along an axis of the space in which vertices are sorted: 2^10.
const STEPS: f64 = 1024.0;
/// Bits of the number of a vertex below its key.
const NUMBER: u32 = 30;

/// The connectors of `histories` that stand for the `vertices` of `thinning` times as many trajectories.
pub fn thinned(
    scene: &Scene,
    vertices: &[&Vertex],
    histories: usize,
    thinning: usize,
    rng: &mut Generator,
) -> Connectors {
    let chosen = chosen(scene, vertices, thinning, rng);
    let mut connectors = Connectors::default();
    for first in 0..histories {
        // In turn, so that each history holds vertices from everywhere.
        let own: Vec<Vertex> = chosen.iter().skip(first).step_by(histories).copied().collect();
        connectors.push(scene, &own);
    }
    connectors
}

/// One of `thinning` of the `vertices`, with the weight of all for which it stands, over `thinning`.
fn chosen(scene: &Scene, vertices: &[&Vertex], thinning: usize, rng: &mut Generator) -> Vec<Vertex> {
    let order = order(vertices);
    let fluxes: Vec<f64> = order.par_iter().map(|&i| reflected(scene, vertices[i])).collect();
    let wanted = vertices.len().div_ceil(thinning);
    let step = fluxes.iter().sum::<f64>() / wanted as f64;
    let mut chosen = Vec::with_capacity(wanted);
    let (mut next, mut passed) = (step * rng.uniform(), 0.0);
    for (i, flux) in order.into_iter().zip(fluxes) {
        passed += flux;
        while next < passed {
            let vertex = *vertices[i];
            chosen.push(Vertex { weight: vertex.weight * (step / (flux * thinning as f64)), ..vertex });
            next += step;
        }
    }
    chosen
}

/// Flux that a vertex reflects, summed over channels, so that none is lost whatever its colour \[lm\].
fn reflected(scene: &Scene, vertex: &Vertex) -> f64 {
    let albedo = scene.surface(vertex.primitive).reflectance.albedo(-vertex.w_in.dot(vertex.normal));
    (vertex.weight * albedo).0.iter().sum()
}

/// The numbers of the vertices, by the axis nearest to the normal and then along a curve through space (Morton's).
fn order(vertices: &[&Vertex]) -> Vec<usize> {
    assert!(vertices.len() < 1 << NUMBER, "{} vertices in a batch", vertices.len());
    let (low, high) = vertices
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), v| (l.min(v.position), h.max(v.position)));
    let scale = STEPS * (1.0 - 1e-9) / (high - low).max_element().max(f64::MIN_POSITIVE);
    let key = |(i, v): (usize, &&Vertex)| {
        let axis = v.normal.abs().max_position();
        let side = 2 * axis as u64 + u64::from(v.normal[axis] < 0.0);
        let place = ((v.position - low) * scale).to_array().map(|x| spread(x as u64));
        let key = side << 30 | place[0] << 2 | place[1] << 1 | place[2];
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
