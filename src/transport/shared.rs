//! Direct light at many receivers at once: lamps and points of emitters are apexes of the visibility kernel, like vertices.
//!
//! ```text
//! E_0(r) = sum_j I_j(r) cos/d^2 V(j, r)  +  1/n sum_i L_e A_e / P_e  G(y_i, r),   y_i uniform on emitter e, chosen with P_e
//! ```
//!
//! The points y_i are those of a scrambled quasi-random set, drawn anew for each batch, and shared by all receivers of a set: one
//! visibility tile costs little more than one ray. Their light is bounded by no solid angle, so a receiver within a length of
//! the longest edge of an emitter does not take part in them, nor does one with a peaked response: it has samples of its own
//! ([`super::direct`]). Who takes part depends on places alone, so both are unbiased.

use super::bodies::from_bodies;
use super::connection::{Connected, Connectors, Link, LitPoint, Rule, TILE, Tile, connect};
use super::direct::{from_afar, from_emitters, from_panels, from_some_emitters};
use super::lamps::{Asked, ask, is_choice};
use super::receiver::Receiver;
use super::sky::from_sky;
use crate::geometry::Ray;
use crate::geometry::visibility::{BUNDLE, BUNDLES, Lanes, Points, Scratch};
use crate::math::{DVec2, DVec3, Vec3};
use crate::photometry::Colour;
use crate::random::Generator;
use crate::random::sobol::PointSet;
use crate::scene::photometric_web::Luminaire;
use crate::scene::{Emitter, Light, Scene};
use std::ops::Range;

/// Nearer than this to the centre, in lengths of its longest edge, an emitter is sampled for each receiver alone.
const NEAR: f64 = 1.0;
/// Receivers that ask the same of many lights: fewer know better which, more share the search for what hides them.
const ASKING_TOGETHER: usize = 64;
/// Points whose light is summed in f32 before it goes into f64.
pub const TOGETHER: usize = 16;

/// Points of the emitters of a scene that receivers share, in runs of [`TOGETHER`]; none where there are many emitters, among which each
/// receiver chooses for itself.
#[derive(Debug, Default)]
pub struct LitPoints {
    runs: Connectors,
}

impl LitPoints {
    /// `count` points, a power of two, by the numbers of `set`.
    pub fn new(scene: &Scene, set: &PointSet, count: u32) -> Self {
        let mut points = LitPoints::default();
        if !scene.sources.shares_points() {
            return points;
        }
        for first in (0..count).step_by(TOGETHER) {
            let run = first..(first + TOGETHER as u32).min(count);
            let run: Vec<LitPoint> = run.flat_map(|i| lit_point(scene, set.point(i), count)).collect();
            points.runs.push_lit(scene, &run);
        }
        points
    }
}

/// The point of an emitter that `numbers` draw, one of `count`, on both sides where both emit.
fn lit_point<const N: usize>(scene: &Scene, numbers: [f64; N], count: u32) -> impl Iterator<Item = LitPoint> + use<N> {
    let (number, probability) = scene.sources.choose_emitter(numbers[0]);
    let emitter = &scene.sources.emitters[number];
    let position = emitter.point(DVec2::new(numbers[1], numbers[2]));
    let intensity = emitter.luminance_at(position) * (emitter.area / (probability * f64::from(count)));
    let lit = move |normal: DVec3| LitPoint { position, normal, intensity, emitter: number as u32 };
    let sides = if emitter.double_sided { 2 } else { 1 };
    [emitter.normal, -emitter.normal].into_iter().take(sides).map(lit)
}

/// Points of emitters that receivers share.
#[derive(Clone, Debug)]
pub struct Shared<'a> {
    /// All points that were drawn together.
    points: &'a LitPoints,
    /// Which runs of [`TOGETHER`] of them are used.
    some: Range<usize>,
    /// One over the share of them that is used.
    weight: f64,
}

impl<'a> Shared<'a> {
    /// All `points`.
    pub fn all(points: &'a LitPoints) -> Self {
        Shared { points, some: 0..points.runs.histories(), weight: 1.0 }
    }

    /// The run number `run`.
    pub fn run(points: &'a LitPoints, run: usize) -> Self {
        Shared { points, some: run..run + 1, weight: points.runs.histories() as f64 }
    }

    /// What they give `receivers`, at most a tile, but for the emitters that are too `near` to some of them.
    fn connect(&self, scene: &Scene, receivers: &[Receiver], near: &[Near], channels: usize) -> Vec<Connected> {
        let link = |&receiver| Link { owner: 0, receiver, start: Colour::BLACK, watched: false };
        let tile = Tile::new(scene, receivers.iter().map(link).collect(), 0).refusing(near.iter().cloned());
        let rule = Rule { bound: f64::INFINITY, channels, orders: 0..1 };
        connect(scene, &self.points.runs, self.some.clone(), &tile, &rule)
    }
}

/// How much of the direct light is asked at a receiver.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Lights without extent, where there are more; 0: none.
    pub lamps: u64,
    /// Samples of each kind of light with an extent.
    pub samples: u64,
    /// Samples of the sky.
    pub of_sky: u64,
}

/// Direct light at `receivers`, at most a tile, each with its generator, times their responses \[lx or cd/m2\]: from few emitters by
/// the shared points, else by samples of its own.
pub fn direct_light(
    scene: &Scene,
    receivers: &mut [(Receiver, &mut Generator)],
    shared: &Shared,
    Effort { lamps, samples, of_sky }: Effort,
    channels: usize,
) -> Vec<Colour> {
    let places: Vec<Receiver> = receivers.iter().map(|(r, _)| *r).collect();
    let together = if is_choice(scene, lamps) { ASKING_TOGETHER } else { TILE };
    let mut light: Vec<Colour> = Vec::with_capacity(places.len());
    for (places, receivers) in places.chunks(together).zip(receivers.chunks_mut(together)) {
        let asked = if lamps > 0 { ask(scene, places, lamps, receivers[0].1) } else { Vec::new() };
        light.extend(of_lights(scene, places, &asked));
    }
    for ((receiver, rng), light) in receivers.iter_mut().zip(&mut light) {
        *light += from_panels(scene, receiver, samples, rng);
        *light += from_bodies(scene, receiver, samples, rng);
        *light += from_sky(scene, receiver, of_sky, rng);
        if receiver.response.is_peaked() || !scene.sources.shares_points() {
            *light += from_emitters(scene, receiver, samples, rng);
        }
    }
    if scene.sources.shares_points() {
        let near = near_emitters(scene, &places);
        let connected = shared.connect(scene, &places, &near, channels);
        let matt = receivers.iter_mut().enumerate().filter(|(_, (receiver, _))| !receiver.response.is_peaked());
        for (i, (receiver, rng)) in matt {
            let own: Vec<u32> = near.iter().filter(|(_, near)| near[i]).map(|(number, _)| *number).collect();
            light[i] += connected[i].sum * shared.weight + from_some_emitters(scene, receiver, &own, samples, rng);
        }
    }
    light
}

/// The number of an emitter, and for each receiver whether it is too near.
type Near = (u32, Vec<bool>);

/// The emitters that are too near to some of the receivers.
fn near_emitters(scene: &Scene, receivers: &[Receiver]) -> Vec<Near> {
    let near = |(number, emitter): (u32, &Emitter)| {
        let ([a, b, c], reach) = (emitter.corners, NEAR * NEAR * emitter.longest_edge_squared());
        let middle = (a + b + c) / 3.0;
        let is_near = |r: &Receiver| r.position.distance_squared(middle) < reach;
        let near: Vec<bool> = receivers.iter().map(is_near).collect();
        near.contains(&true).then_some((number, near))
    };
    (0..).zip(&scene.sources.emitters).filter_map(near).collect()
}

/// Light from the lights `asked` at `receivers`, at most a tile, times their responses \[lx or cd/m2\].
pub fn of_lights(scene: &Scene, receivers: &[Receiver], asked: &[Asked]) -> Vec<Colour> {
    let mut sums = vec![Colour::BLACK; receivers.len()];
    if asked.is_empty() {
        return sums;
    }
    let lifted: Vec<Vec3> = receivers.iter().map(|r| scene.geometry.lift(r.position, r.normal).as_vec3()).collect();
    let points = Points::new(&scene.geometry, &lifted);
    for &(number, weight) in asked {
        let light = &scene.sources.lights[number];
        let arriving: Vec<_> = receivers.iter().map(|r| light.at(r.position)).collect();
        let mut seen: Lanes = [0; BUNDLES];
        for (i, (receiver, (_, w_in, across))) in receivers.iter().zip(&arriving).enumerate() {
            // At the lamp itself the cosine is NaN, which is not above zero: no light instead of no number.
            let lit = -receiver.normal.dot(*w_in) > 0.0 && !across.is_black();
            seen[i / BUNDLE] |= u16::from(lit) << (i % BUNDLE);
        }
        match light {
            Light::Directional { direction, .. } => shadow_of_parallel(scene, *direction, receivers, &mut seen),
            Light::Omni { position, .. }
            | Light::Spot { position, .. }
            | Light::CosPower { position, .. }
            | Light::Luminaire(Luminaire { position, .. }) => {
                let apex = scene.geometry.apex(position.as_vec3());
                scene.geometry.hide(&apex, &points, &mut seen, &mut Scratch::default());
            }
        }
        for (i, (receiver, (_, w_in, across))) in receivers.iter().zip(&arriving).enumerate() {
            if seen[i / BUNDLE] >> (i % BUNDLE) & 1 == 1 {
                let cosine = -receiver.normal.dot(*w_in);
                let through =
                    if scene.geometry.has_veils() { veiled(scene, light, lifted[i], *w_in) } else { Colour::WHITE };
                sums[i] += *across * through * (weight * cosine) * receiver.response.to(scene, receiver.normal, *w_in);
            }
        }
    }
    sums
}

/// The share that veils let through of the light that `light`, which is seen, sends to the lifted point along `w_in`.
fn veiled(scene: &Scene, light: &Light, lifted: Vec3, w_in: DVec3) -> Colour {
    match light.at(lifted.as_dvec3()).0 {
        Some(position) => scene.veiled(position.as_vec3(), lifted),
        None => from_afar(scene, &Ray { origin: lifted.as_dvec3(), direction: -w_in }),
    }
}

/// Clears the bits of the receivers that something hides from parallel light.
fn shadow_of_parallel(scene: &Scene, direction: DVec3, receivers: &[Receiver], seen: &mut Lanes) {
    for (i, receiver) in receivers.iter().enumerate() {
        let (bundle, lane) = (i / BUNDLE, i % BUNDLE);
        let origin = scene.geometry.lift(receiver.position, receiver.normal);
        let ray = Ray { origin, direction: -direction };
        if seen[bundle] >> lane & 1 == 1 && from_afar(scene, &ray).is_black() {
            seen[bundle] &= !(1 << lane);
        }
    }
}
