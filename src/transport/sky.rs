//! Direct light of the sky at a receiver.
//!
//! ```text
//! E_sky(r) = int L(v) (N_r,v)_+ V dw  =  1/n sum_i  L(v_i) (N_r,v_i) / q(v_i)   over those v_i along which nothing stands but veils
//! q(v)     = c p'(v) + (1 - c) sum_k b_k d_k^2/(A_k |cos_k|)
//! ```
//!
//! p' is the density of [`Sky`] with what would leave below the receiver's plane mirrored there; the openings that a line from r
//! along v passes are k, at the distance d_k. Whatever the openings are, q is what directions are drawn from, and c > 0: so
//! the estimate is unbiased, and bounded beside them. A peaked response looks at the sky as well, and the two are weighed by the balance
//! heuristic, as for area lights ([`super::direct`]). The directions of a receiver fill their square evenly, with a random shift.

use super::direct::{density_of_response, from_afar};
use super::receiver::Receiver;
use crate::geometry::Ray;
use crate::math::{DVec2, DVec3};
use crate::photometry::Colour;
use crate::random::{Generator, evenly};
use crate::scene::{Aim, Opening, Scene, Sky};

/// c, the share of directions drawn from the whole sky where there are openings.
const WHOLE: f64 = 0.25;

/// Unbiased estimate of the light from the sky by `samples` samples, times the response \[lx or cd/m2\].
pub fn from_sky(scene: &Scene, receiver: &Receiver, samples: u64, rng: &mut Generator) -> Colour {
    let Some(environment) = &scene.sources.environment else { return Colour::BLACK };
    let Some(sky) = &environment.sky else { return Colour::BLACK };
    let view = View::new(scene, sky, &environment.openings, receiver);
    let directions = view.directions(samples, rng);
    let ray = |&direction: &DVec3| Ray { origin: view.from, direction };
    let rays: Vec<Ray> = directions.iter().map(ray).collect();
    let mut hits = vec![None; rays.len()];
    scene.geometry.closest_hits(&rays, &mut hits);
    let veiled = scene.geometry.has_veils();
    let mut sum = Colour::BLACK;
    for (ray, hit) in rays.iter().zip(&hits) {
        match hit {
            None => sum += view.light(ray.direction),
            Some(_) if veiled => sum += from_afar(scene, ray) * view.light(ray.direction),
            Some(_) => {}
        }
    }
    if receiver.response.is_peaked() {
        for _ in 0..samples {
            sum += view.where_the_response_looks(rng);
        }
    }
    sum / samples as f64
}

/// The sky as a receiver sees it.
struct View<'a> {
    scene: &'a Scene,
    sky: &'a Sky,
    receiver: &'a Receiver,
    /// Its lifted point.
    from: DVec3,
    aim: Aim<'a>,
    /// c of this receiver.
    whole: f64,
}

impl<'a> View<'a> {
    fn new(scene: &'a Scene, sky: &'a Sky, openings: &'a [Opening], receiver: &'a Receiver) -> Self {
        let from = scene.geometry.lift(receiver.position, receiver.normal);
        let aim = Aim::new(openings, from);
        let whole = if openings.is_empty() { 1.0 } else { WHOLE };
        View { scene, sky, receiver, from, aim, whole }
    }

    /// Directions drawn towards the sky, below the receiver's plane left out.
    fn directions(&self, samples: u64, rng: &mut Generator) -> Vec<DVec3> {
        let (choice, shift) = (rng.uniform(), rng.uniform2());
        let draw = |k: u64| self.direction((k as f64 + choice) / samples as f64, evenly(shift, k));
        (0..samples).map(draw).filter(|v| v.dot(self.receiver.normal) > 0.0).collect()
    }

    /// The direction that `choice` in [0, 1) and `u` draw; zero where an opening has none.
    fn direction(&self, choice: f64, u: DVec2) -> DVec3 {
        if choice < self.whole {
            return self.sky.sample_above(self.receiver.normal, u);
        }
        self.aim.direction((choice - self.whole) / (1.0 - self.whole), u)
    }

    /// q(v) \[1/sr\].
    fn density(&self, v: DVec3) -> f64 {
        self.whole * self.sky.density_above(self.receiver.normal, v) + (1.0 - self.whole) * self.aim.density(v)
    }

    /// What an unobstructed direction that was drawn counts.
    fn light(&self, v: DVec3) -> Colour {
        let Receiver { normal, response, .. } = self.receiver;
        let both = self.density(v) + density_of_response(self.scene, self.receiver, -v);
        if both <= 0.0 {
            return Colour::BLACK;
        }
        self.sky.luminance(v) * (normal.dot(v) / both) * response.to(self.scene, *normal, -v)
    }

    /// One sample of the light where the peaked response looks.
    fn where_the_response_looks(&self, rng: &mut Generator) -> Colour {
        let Receiver { normal, response, .. } = self.receiver;
        let Some((v, weight)) = response.sample(self.scene, *normal, rng) else { return Colour::BLACK };
        let share = from_afar(self.scene, &Ray { origin: self.from, direction: v });
        if share.is_black() {
            return Colour::BLACK;
        }
        let density = density_of_response(self.scene, self.receiver, -v);
        self.sky.luminance(v) * share * weight * (density / (density + self.density(v)))
    }
}
