//! Reverse estimation: paths from the receiver that find the light, a cross-check of local estimation.
//!
//! A path leaves the receiver y_0 = r in a direction drawn by what its response weights, goes from surface point to
//! surface point by sampling reflectances, and adds up the light it meets. With v_k the direction from y_k to y_{k+1}:
//!
//! ```text
//! T_1     = g(r; v_0) |(N_r,v_0)| / pdf(v_0)             illuminance: pi;  luminance: f(r; -v_0 -> l) |cos| / pdf
//! T_{k+1} = T_k f(y_k; -v_k -> -v_{k-1}) |(N_k,v_k)| / pdf(v_k) / P_survive
//! J       = sum_{k>=1} T_k { L0(y_k) + sum_lights E_j(y_k) f(y_k; w_j -> -v_{k-1}) }
//! ```
//!
//! E_j is the illuminance from a light without extent, by a shadow ray of its own; area lights are found by hitting
//! them, the sky by leaving the scene. The laws of reflection are reciprocal, so `sample` with the path's own direction of travel draws v_k. What
//! lights without extent give r itself is [`lights_at`]; L0(r) belongs to the ray of the eye.
//!
//! The quantity is that of local estimation, which cannot carry light whose last surface before r is a delta surface:
//! a path whose receiver or first surface reflects it by a delta component ends there. Later mirrors are followed.
//! Light that reaches y_k, k >= 2, from a light without extent over a mirror is never found by a shadow ray, nor by
//! hits: there, and only there, this estimate is lower than the local one.
//!
//! It shares geometry, reflectances, the list of sources and the definition of a receiver with local estimation, and
//! nothing else; it must not know trajectories, connections nor the sampling of area lights.

use super::receiver::{Receiver, Response};
use crate::geometry::Ray;
use crate::job::{Roulette, Transport};
use crate::math::{DVec3, PI, to_world};
use crate::photometry::Colour;
use crate::random::{Generator, cosine_hemisphere};
use crate::scene::{Light, Scattered, Scene};

/// Guard against paths that never end.
const MAX_VERTICES: u32 = 1 << 16;

/// The light that one path found, times the response \[lx or cd/m2\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Found {
    /// Emitted by the first surface met: direct light of area lights.
    pub direct: Colour,
    /// All other light.
    pub reflected: Colour,
    /// About what narrow lobes reflected of lights without extent: what they would reflect if they were matt.
    pub caustic: Colour,
}

/// Follows one path from `receiver`.
pub fn path(scene: &Scene, transport: &Transport, receiver: &Receiver, rng: &mut Generator) -> Found {
    let mut found = Found::default();
    let Some((mut ray, mut weight)) = leave(scene, receiver, rng) else { return found };
    let first = weight.luminance();
    for met in 1..=MAX_VERTICES {
        let emitted = if met == 1 { &mut found.direct } else { &mut found.reflected };
        let (hit, share) = match scene.geometry.closest_hit(&ray) {
            Some(hit) => scene.met_from(hit, ray.direction, true, rng),
            None => (None, Colour::WHITE),
        };
        weight = weight * share;
        let Some(hit) = hit else {
            *emitted += weight * scene.beyond(ray.direction);
            break;
        };
        if scene.absorbs(&hit) {
            break;
        }
        let reflectance = scene.reflectance(hit.primitive, hit.position);
        let back = -ray.direction;
        let response = |w_in| reflectance.evaluate(hit.normal, w_in, back);
        *emitted += weight * scene.emitted(&hit, back);
        found.reflected += weight * from_lights(scene, hit.position, hit.normal, response);
        if reflectance.sides().is_some() {
            let transmitted = |w_in| reflectance.evaluate(-hit.normal, w_in, back);
            found.reflected += weight * from_lights(scene, hit.position, -hit.normal, transmitted);
        }
        if reflectance.is_peaked_at(back.dot(hit.normal)) {
            let matt = |w_in: DVec3| reflectance.albedo(-w_in.dot(hit.normal)) / PI;
            found.caustic += weight * from_lights(scene, hit.position, hit.normal, matt);
        }
        let Some(next) = scene.scatter_eye_ray(&hit, ray.direction, rng) else { break };
        // No connection carries what a mirror sends straight to the receiver.
        if met == 1 && next.delta {
            break;
        }
        let Some(survivor) = play(transport.roulette_below, first, weight, weight * next.factor, rng) else { break };
        weight = survivor;
        ray = scene.leaving(&hit, &next);
    }
    found
}

/// Light of sources without extent at `receiver` itself, times the response \[lx or cd/m2\].
pub fn lights_at(scene: &Scene, receiver: &Receiver) -> Colour {
    from_lights(scene, receiver.position, receiver.normal, |w_in| match receiver.response {
        Response::Cosine => Colour::WHITE,
        Response::Reflectance { primitive, position, to_eye, attenuation, .. } => {
            scene.reflectance(primitive, position).evaluate(receiver.normal, w_in, to_eye) * attenuation
        }
    })
}

/// The first ray of a path and T_1; `None` where the receiver is sampled in a direction that gives it nothing.
fn leave(scene: &Scene, receiver: &Receiver, rng: &mut Generator) -> Option<(Ray, Colour)> {
    let normal = receiver.normal;
    let (direction, weight) = match receiver.response {
        Response::Cosine => (to_world(normal, cosine_hemisphere(rng.uniform2())), Colour::grey(PI)),
        Response::Reflectance { primitive, position, to_eye, attenuation, .. } => {
            let drawn = match receiver.response.side(scene, normal) {
                Some(colour) => {
                    let direction = to_world(normal, cosine_hemisphere(rng.uniform2()));
                    Scattered { direction, factor: colour, delta: false, transmitted: false }
                }
                None => scene.reflectance(primitive, position).sample(normal, -to_eye, rng)?,
            };
            (!drawn.delta).then_some((drawn.direction, attenuation * drawn.factor))?
        }
    };
    let origin = scene.geometry.lift(receiver.position, normal);
    (!weight.is_black()).then_some((Ray { origin, direction }, weight))
}

/// Illuminance of a surface point by each light without extent, times the response to it.
fn from_lights(scene: &Scene, position: DVec3, normal: DVec3, response: impl Fn(DVec3) -> Colour) -> Colour {
    let lifted = scene.geometry.lift(position, normal);
    let mut sum = Colour::BLACK;
    for light in &scene.sources.lights {
        let (_, w_in, across) = light.at(position);
        let cosine = -normal.dot(w_in);
        if cosine > 0.0 && !across.is_black() {
            sum += across * lit(scene, lifted, light) * cosine * response(w_in);
        }
    }
    sum
}

/// The share of light that gets from `light` to the lifted point: a ray, not the segments of the connections.
fn lit(scene: &Scene, lifted: DVec3, light: &Light) -> Colour {
    let (from, w_in, _) = light.at(lifted);
    let distance = from.map_or(f64::INFINITY, |p| (p - lifted).length());
    match scene.straight(&Ray { origin: lifted, direction: -w_in }, distance) {
        (Some(hit), _) if hit.distance < distance => Colour::BLACK,
        (_, share) => share,
    }
}

/// Russian roulette: the weight T_{k+1} with which the path goes on, or `None` where it ends; `first` is the luminous
/// T_1.
fn play(roulette: Roulette, first: f64, weight: Colour, reflected: Colour, rng: &mut Generator) -> Option<Colour> {
    if reflected.is_black() {
        return None;
    }
    let survival = match roulette {
        Roulette::Below(share) => weight.luminance() / (share * first),
        Roulette::Analog(_) => reflected.luminance() / weight.luminance(),
    };
    let survival = survival.min(1.0);
    (survival == 1.0 || rng.uniform() < survival).then(|| reflected / survival)
}
