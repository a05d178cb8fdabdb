//! Direct light of star-shaped objects that emit.

use super::direct::{density_of_response, sampled};
use super::receiver::Receiver;
use crate::geometry::{Hit, Ray};
use crate::math::{DVec3, PI};
use crate::photometry::Colour;
use crate::random::Generator;
use crate::scene::{Body, BodyPoint, Scene, in_cone};

/// Unbiased estimate of the light from emissive star-shaped objects by `samples` samples, times the response \[lx or cd/m2\].
pub fn from_bodies(scene: &Scene, receiver: &Receiver, samples: u64, rng: &mut Generator) -> Colour {
    if scene.sources.bodies.is_empty() {
        return Colour::BLACK;
    }
    let draw = |from: DVec3, choice: f64, rng: &mut Generator| {
        let (body, probability) = scene.sources.choose_body(choice);
        View { scene, body, probability, from }.sample(receiver, rng)
    };
    let seen = |from: DVec3, hit: &Hit, w_in: DVec3| {
        let (body, probability) = scene.sources.body(hit.primitive)?;
        let point = body.point_at(&scene.geometry, hit.position);
        body.lit_side(&point, from)?;
        Some((body.luminance, View { scene, body, probability, from }.density(&point, w_in)))
    };
    sampled(scene, receiver, samples, rng, draw, seen)
}

/// A body seen from a lifted point.
struct View<'a> {
    scene: &'a Scene,
    body: &'a Body,
    /// Probability of its choice.
    probability: f64,
    from: DVec3,
}

impl View<'_> {
    fn sample(&self, receiver: &Receiver, rng: &mut Generator) -> Colour {
        let point = if rng.uniform() < 0.5 { self.by_area(rng) } else { self.by_direction(rng) };
        let Some((point, through)) = point else { return Colour::BLACK };
        let w_in = (self.from - point.position).normalize();
        let cosine = -receiver.normal.dot(w_in);
        if cosine <= 0.0 {
            return Colour::BLACK;
        }
        let both = self.density(&point, w_in) + density_of_response(self.scene, receiver, w_in);
        self.body.luminance * through * (cosine / both) * receiver.response.to(self.scene, receiver.normal, w_in)
    }

    /// A point drawn from the surface, where it is seen and lit, and the share of its light that veils let through.
    fn by_area(&self, rng: &mut Generator) -> Option<(BodyPoint, Colour)> {
        let geometry = &self.scene.geometry;
        let point = self.body.point(geometry, rng.uniform2());
        let side = self.body.lit_side(&point, self.from)?;
        let target = geometry.lift(point.position, side);
        let through = self.scene.transmittance(self.from.as_vec3(), target.as_vec3());
        (!through.is_black()).then_some((point, through))
    }

    /// The point in a direction that may show the body, where it does, and the share of its light that veils let through.
    fn by_direction(&self, rng: &mut Generator) -> Option<(BodyPoint, Colour)> {
        let geometry = &self.scene.geometry;
        let (axis, height) = self.body.seen_from(geometry, self.from);
        let direction = in_cone(axis, height, rng.uniform2());
        let (hit, through) = self.scene.straight(&Ray { origin: self.from, direction }, f64::INFINITY);
        let hit = hit?;
        let point = (hit.primitive == self.body.primitive).then(|| self.body.point_at(geometry, hit.position))?;
        self.body.lit_side(&point, self.from)?;
        Some((point, through))
    }

    /// Density in solid angle with which `point` is drawn in either way, the choice of the body included \[1/sr\].
    fn density(&self, point: &BodyPoint, w_in: DVec3) -> f64 {
        let d2 = (self.from - point.position).length_squared();
        let by_area = d2 / (point.area * point.normal.dot(w_in).abs());
        let (_, height) = self.body.seen_from(&self.scene.geometry, self.from);
        0.5 * self.probability * (by_area + 1.0 / (2.0 * PI * height))
    }
}
