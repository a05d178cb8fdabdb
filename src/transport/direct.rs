//! Direct light at a receiver, never from particle hits: E_0, and with a reflectance as response K L0.
//!
//! Lights without extent are exact. Area lights are sampled: an emitter chosen in proportion to flux (the choice
//! stratified over the samples), then a direction uniform in its solid angle, which stays bounded at contact.

use super::receiver::Receiver;
use super::spherical_triangle::SphericalTriangle;
use crate::math::DVec3;
use crate::photometry::Colour;
use crate::random::Generator;
use crate::scene::{Emitter, Scene};

/// From this distance in lengths of its longest edge on, a triangle is sampled by area: the geometric factor then
/// varies less than twofold over it, and the solid angle of a tiny triangle need not be computed.
const FAR: f64 = 3.0;

/// Area-light samples of one receiver and batch: proportional to the histories, so that no share of the variance
/// stays when the histories grow.
pub fn emitter_samples(histories: u64) -> u64 {
    (histories / 8).max(1)
}

/// Light from point, spot and directional lights, times the response \[lx or cd/m2\].
pub fn from_lights(scene: &Scene, receiver: &Receiver) -> Colour {
    let lifted = scene.geometry.lift(receiver.position, receiver.normal);
    let mut sum = Colour::BLACK;
    for light in &scene.sources.lights {
        let (from, w_in, across) = light.at(receiver.position);
        let cosine = -receiver.normal.dot(w_in);
        if cosine <= 0.0 || across.is_black() {
            continue;
        }
        let visible = match from {
            Some(position) => scene.geometry.visible(lifted.as_vec3(), position.as_vec3()),
            None => scene.geometry.closest_hit(&crate::geometry::Ray { origin: lifted, direction: -w_in }).is_none(),
        };
        if visible {
            sum += across * cosine * receiver.response.to(scene, receiver.normal, w_in);
        }
    }
    sum
}

/// Unbiased estimate of the light from area lights by `samples` samples, times the response \[lx or cd/m2\].
pub fn from_emitters(scene: &Scene, receiver: &Receiver, samples: u64, rng: &mut Generator) -> Colour {
    if scene.sources.emitters.is_empty() {
        return Colour::BLACK;
    }
    // Sampled as seen from the lifted point, where visibility starts: both must agree on which side of an emitter it is.
    let lifted = scene.geometry.lift(receiver.position, receiver.normal);
    let mut sum = Colour::BLACK;
    for k in 0..samples {
        let stratum = (k as f64 + rng.uniform()) / samples as f64;
        let (emitter, probability) = scene.sources.choose_emitter(stratum);
        sum += sample_emitter(scene, receiver, lifted, emitter, rng) / probability;
    }
    sum / samples as f64
}

/// One sample of the light from `emitter`.
fn sample_emitter(scene: &Scene, receiver: &Receiver, from: DVec3, emitter: &Emitter, rng: &mut Generator) -> Colour {
    let side = emitter.normal.dot(from - emitter.corners[0]);
    if side == 0.0 || (side < 0.0 && !emitter.double_sided) {
        return Colour::BLACK;
    }
    let normal = emitter.normal * side.signum();
    let Some((point, solid_angle)) = sample_point(from, emitter, normal, rng) else {
        return Colour::BLACK;
    };
    let w_in = (from - point).normalize();
    let cosine = -receiver.normal.dot(w_in);
    let target = scene.geometry.lift(point, normal).as_vec3();
    if cosine <= 0.0 || !scene.geometry.visible(from.as_vec3(), target) {
        return Colour::BLACK;
    }
    emitter.luminance * (cosine * solid_angle) * receiver.response.to(scene, receiver.normal, w_in)
}

/// A point of `emitter` and one over its density in solid angle seen from `from` \[sr\].
fn sample_point(from: DVec3, emitter: &Emitter, normal: DVec3, rng: &mut Generator) -> Option<(DVec3, f64)> {
    let [a, b, c] = emitter.corners;
    let edge2 = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    let random = rng.uniform2();
    if ((a + b + c) / 3.0 - from).length_squared() > FAR * FAR * edge2 {
        let point = emitter.point(random);
        let way = from - point;
        let d2 = way.length_squared();
        return Some((point, emitter.area * normal.dot(way) / (d2 * d2.sqrt())));
    }
    let triangle = SphericalTriangle::new(&emitter.corners, from);
    let direction = triangle.sample(random);
    let distance = normal.dot(a - from) / normal.dot(direction);
    (distance > 0.0 && distance.is_finite()).then(|| (from + distance * direction, triangle.solid_angle))
}
