//! Neighbours share the first points of their continuations.
//!
//! A matt receiver r draws y on a matt surface with the density G(r,y)/pi an area, where G > b, and y gives it the light
//! that comes from there beyond b. Any other receiver of the group that sees y as near may use it as well. All
//! points of all m receivers of a group, one of each, are one sample of the sum of their densities (the balance heuristic of
//! Veach and Guibas 1995), so that with the light E(y) that arrives at y
//!
//! ```text
//! J_1(r_i) = g_0 sum_j (G(r_i,y_j) - b)_+ / p(y_j)  rho(y_j)/pi E(y_j),    p(y) = sum_i G(r_i,y)/pi 1{G(r_i,y) > b}
//! ```
//!
//! For a receiver without neighbours that is its own estimate, pi g_0 (1 - b/G) rho/pi E; among many, each has the points of all:
//! one tile of visibility instead of a ray for each. No weight exceeds pi g_0. What the points are does not depend on
//! who uses them, so every receiver keeps its expectation; the errors of neighbours are no longer independent within a batch.

use super::receiver::Receiver;
use crate::geometry::visibility::{BUNDLE, BUNDLES, Lanes, Points, Scratch};
use crate::math::{DVec3, PI, Vec3};
use crate::photometry::Colour;
use crate::scene::Scene;

/// Receivers of a group: chosen by measured figure of merit (docs/benchmarks.md).
pub const GROUP: usize = 64;

/// A group of neighbouring receivers.
pub struct Neighbours {
    places: Vec<(DVec3, DVec3)>,
    /// g_0 of each; None where it is not matt, or black, so that it draws nothing and takes no part.
    responses: Vec<Option<Colour>>,
    lifted: Points,
    bound: f64,
}

impl Neighbours {
    /// The group of `receivers`, at most [`GROUP`], with the bound b of the kernel \[1/m2\].
    pub fn new<'a>(scene: &Scene, receivers: impl Iterator<Item = &'a Receiver>, bound: f64) -> Self {
        let (places, responses): (Vec<_>, Vec<_>) = receivers
            .map(|r| ((r.position, r.normal), r.response.constant(scene, r.normal).filter(|g| !g.is_black())))
            .unzip();
        assert!(places.len() <= GROUP, "a group has {GROUP} receivers");
        let lift = |(position, normal): &(DVec3, DVec3)| scene.geometry.lift(*position, *normal).as_vec3();
        let lifted: Vec<Vec3> = places.iter().map(lift).collect();
        Neighbours { lifted: Points::new(&scene.geometry, &lifted), places, responses, bound }
    }

    /// What the light reflected at the point `y`, which receiver number `own` has found, counts at each receiver:
    /// g_0 (G - b)_+ / p, black where it is not used.
    pub fn weights(&self, scene: &Scene, y: &Receiver, own: usize, scratch: &mut Scratch) -> [Colour; GROUP] {
        let mut factors = [0.0; GROUP];
        let mut seen: Lanes = [0; BUNDLES];
        for (i, (position, normal)) in self.places.iter().enumerate() {
            let way = y.position - *position;
            let d2 = way.length_squared();
            factors[i] = way.dot(*normal).max(0.0) * (-way.dot(y.normal)).max(0.0) / (d2 * d2);
            // Written so that NaN, a receiver at the point itself, is not seen.
            let near = factors[i] > self.bound && self.responses[i].is_some();
            seen[i / BUNDLE] |= u16::from(near) << (i % BUNDLE);
        }
        let apex = scene.geometry.apex(scene.geometry.lift(y.position, y.normal).as_vec3());
        scene.geometry.hide(&apex, &self.lifted, &mut seen, scratch);
        // The ray by which it was found has seen it, whatever rounding makes of the segment.
        seen[own / BUNDLE] |= 1 << (own % BUNDLE);
        let is_seen = |i: usize| seen[i / BUNDLE] >> (i % BUNDLE) & 1 == 1;
        let density: f64 = (0..self.places.len()).filter(|&i| is_seen(i)).map(|i| factors[i]).sum();
        let mut weights = [Colour::BLACK; GROUP];
        for (i, response) in self.responses.iter().enumerate().filter(|(i, _)| is_seen(*i)) {
            weights[i] = response.unwrap_or(Colour::BLACK) * (PI * (factors[i] - self.bound) / density);
        }
        weights
    }
}
