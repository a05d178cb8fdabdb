//! Direct light of star-shaped objects that emit.
//!
//! A ball is asked in directions uniform in projected solid angle ([`super::projected_cap`]), others by area and by direction in halves.

use super::direct::{density_of_response, sampled};
use super::projected_cap::ProjectedCap;
use super::receiver::Receiver;
use crate::geometry::{Hit, Ray};
use crate::math::{DVec2, DVec3, PI};
use crate::photometry::Colour;
use crate::random::Generator;
use crate::scene::{Body, BodyPoint, Chosen, Scene, in_cone};

/// Unbiased estimate of the light from emissive star-shaped objects by `samples` samples, times the response \[lx or cd/m2\].
pub fn from_bodies(scene: &Scene, receiver: &Receiver, samples: u64, rng: &mut Generator) -> Colour {
    let draw = |from: DVec3, chosen: &Chosen, random: DVec2, rng: &mut Generator| {
        let view = View::new(scene, receiver, chosen.number, from);
        view.map_or(Colour::BLACK, |view| view.sample(chosen.probability, random, rng))
    };
    let seen = |from: DVec3, hit: &Hit, w_in: DVec3| {
        let number = scene.sources.body(hit.primitive)?;
        let view = View::new(scene, receiver, number, from)?;
        let point = view.body.point_at(&scene.geometry, hit.position);
        view.body.lit_side(&point, from)?;
        Some((number, (view.body.luminance, view.density(&point, w_in))))
    };
    sampled(scene, receiver, scene.sources.body_tree(), (samples, rng), draw, seen)
}

/// A body as a receiver sees it.
struct View<'a> {
    scene: &'a Scene,
    receiver: &'a Receiver,
    body: &'a Body,
    /// The lifted point of the receiver.
    from: DVec3,
    /// Of a ball.
    cap: Option<ProjectedCap>,
}

impl<'a> View<'a> {
    /// The body `number`; `None` where it is a ball that gives nothing.
    fn new(scene: &'a Scene, receiver: &'a Receiver, number: usize, from: DVec3) -> Option<Self> {
        let body = &scene.sources.bodies[number];
        let mut view = View { scene, receiver, body, from, cap: None };
        // From within, a ball that emits inside as well is as any other body.
        let (center, radius) = body.ball(&scene.geometry);
        if body.is_round() && center.distance_squared(from) > radius * radius {
            view.cap = Some(ProjectedCap::new(center - from, radius, receiver.normal)?);
        }
        Some(view)
    }

    /// One sample of its light, where it is chosen with this probability.
    fn sample(&self, probability: f64, random: DVec2, rng: &mut Generator) -> Colour {
        let by_area = self.cap.is_none() && rng.uniform() < 0.5;
        let point = if by_area { self.by_area(random) } else { self.by_direction(random) };
        let Some((point, through)) = point else { return Colour::BLACK };
        let w_in = (self.from - point.position).normalize();
        let Receiver { normal, response, .. } = self.receiver;
        let cosine = -normal.dot(w_in);
        if cosine <= 0.0 {
            return Colour::BLACK;
        }
        let both = probability * self.density(&point, w_in) + density_of_response(self.scene, self.receiver, w_in);
        self.body.luminance * through * (cosine / both) * response.to(self.scene, *normal, w_in)
    }

    /// A point drawn from the surface, where it is seen and lit, and the share of its light that veils let through.
    fn by_area(&self, random: DVec2) -> Option<(BodyPoint, Colour)> {
        let geometry = &self.scene.geometry;
        let point = self.body.point(geometry, random);
        let side = self.body.lit_side(&point, self.from)?;
        let target = geometry.lift(point.position, side);
        let through = self.scene.transmittance(self.from.as_vec3(), target.as_vec3());
        (!through.is_black()).then_some((point, through))
    }

    /// The point in a direction that may show the body, where it does, and the share of its light that veils let through.
    fn by_direction(&self, random: DVec2) -> Option<(BodyPoint, Colour)> {
        let geometry = &self.scene.geometry;
        let direction = match &self.cap {
            Some(cap) => cap.direction(random),
            None => {
                let (axis, height) = self.body.seen_from(geometry, self.from);
                in_cone(axis, height, random)
            }
        };
        let (hit, through) = self.scene.straight(&Ray { origin: self.from, direction }, f64::INFINITY);
        let hit = hit?;
        let point = (hit.primitive == self.body.primitive).then(|| self.body.point_at(geometry, hit.position))?;
        self.body.lit_side(&point, self.from)?;
        Some((point, through))
    }

    /// Density in solid angle with which `point` is drawn in either way \[1/sr\].
    fn density(&self, point: &BodyPoint, w_in: DVec3) -> f64 {
        if let Some(cap) = &self.cap {
            return -self.receiver.normal.dot(w_in) / cap.area;
        }
        let d2 = (self.from - point.position).length_squared();
        let by_area = d2 / (point.area * point.normal.dot(w_in).abs());
        let (_, height) = self.body.seen_from(&self.scene.geometry, self.from);
        0.5 * (by_area + 1.0 / (2.0 * PI * height))
    }
}
