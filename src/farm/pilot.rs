//! The bound b of the kernel, fixed before the run and written into the plan (docs/method.md, section 6).
//!
//! b shall make the largest score of a history some c times the indirect illuminance E to be expected at a receiver:
//! Phi rho b/pi = c E, with Phi the flux of all sources and rho the mean reflectance. In a closed scene E is known on the
//! average, Phi rho/(S (1 - rho)) with S the surface area, so b = c pi/(S (1 - rho)). In an open one E is estimated for
//! each receiver set by a few trajectories of its own, keyed by the name of the set: another set changes nothing.
//! Any b gives an unbiased result; a good one gives a small variance. No score of the run is ever looked at.

use super::receivers::ReceiverSet;
use crate::job::Job;
use crate::math::{DVec3, PI, ceil};
use crate::photometry::Colour;
use crate::random::{Domain, Stream};
use crate::scene::Scene;
use crate::transport::receiver::Receiver;
use crate::transport::trajectory::{Vertex, trace};

/// c: chosen by measured figure of merit (docs/benchmarks.md).
const SCORE_OF_A_HISTORY: f64 = 10.0;
/// Trajectories of a pilot.
const TRAJECTORIES: u64 = 1024;
/// Bins of a set at which a pilot estimates.
const SAMPLED_BINS: f64 = 64.0;
/// Largest mean reflectance taken at its word: in a scene that absorbs nothing b would have no bound.
const BRIGHTEST: f64 = 0.98;

/// b of each receiver set of `job`, in job order \[1/m2\]; empty where nothing is bounded.
pub fn bounds(job: &Job, scene: &Scene) -> Vec<f64> {
    if !job.is_bounded() {
        return Vec::new();
    }
    let shapes = job.sets();
    if is_closed(job, scene) {
        return vec![bound_of_closed(scene); shapes.len()];
    }
    let sets = ReceiverSet::all(&thinned(job), scene, &[]);
    let mut bounds: Vec<f64> = sets.iter().map(|set| bound_of_set(job, scene, set)).collect();
    // Regions are made of pixels, and have no connections of their own.
    bounds.resize(shapes.len(), f64::INFINITY);
    bounds
}

/// The job with about [`SAMPLED_BINS`] bins in each receiver set, spread over the same places.
fn thinned(job: &Job) -> Job {
    let mut thin = job.clone();
    let cameras = thin.cameras.iter_mut().map(|c| (&mut c.width, &mut c.height));
    let gonios = thin.gonios.iter_mut().map(|g| (&mut g.width, &mut g.height));
    let grids = thin.grids.iter_mut().map(|g| (&mut g.columns, &mut g.rows));
    for (width, height) in cameras.chain(gonios).chain(grids) {
        let bins = f64::from(*width) * f64::from(*height);
        let step = ceil((bins / SAMPLED_BINS).sqrt()) as u32;
        (*width, *height) = (width.div_ceil(step), height.div_ceil(step));
    }
    thin
}

/// True when no trajectory of a pilot leaves the scene.
fn is_closed(job: &Job, scene: &Scene) -> bool {
    let stream = Stream::new(job.run.seed, Domain::Pilot, "");
    let escaped = |i| trace(scene, &job.transport, &mut stream.generator(i), &mut Vec::<Vertex>::new()).escaped;
    !scene.geometry.is_unbounded() && (0..TRAJECTORIES).all(|i| escaped(i) == 0.0)
}

fn bound_of_closed(scene: &Scene) -> f64 {
    let (mut area, mut reflecting) = (0.0, 0.0);
    for primitive in 0..scene.primitives() {
        let surface = scene.surface(primitive);
        if surface.is_veil() && surface.reflectance.is_black() {
            continue;
        }
        let sides = if surface.double_sided { 2.0 } else { 1.0 };
        let side = sides * scene.geometry.area(primitive);
        area += side;
        // What goes straight on is not absorbed either.
        reflecting += side * (surface.reflectance.albedo(0.5) + surface.reflectance.straight(0.5)).luminance();
    }
    SCORE_OF_A_HISTORY * PI / (area * (1.0 - (reflecting / area).min(BRIGHTEST)))
}

fn bound_of_set(job: &Job, scene: &Scene, set: &ReceiverSet) -> f64 {
    let stream = Stream::new(job.run.seed, Domain::Pilot, &set.shape().name);
    let mut vertices = Vec::new();
    for i in 0..TRAJECTORIES {
        trace(scene, &job.transport, &mut stream.generator(i), &mut vertices);
    }
    let mut found: Vec<f64> = (0..set.shape().bins())
        .filter_map(|bin| set.receiver(scene, bin))
        .map(|receiver| indirect(scene, &vertices, &receiver))
        .filter(|e| *e > 0.0)
        .collect();
    let arriving: f64 = vertices.iter().map(|v| v.weight.luminance()).sum();
    let leaving: f64 = vertices.iter().map(|v| reflected(scene, v).luminance()).sum();
    if found.is_empty() || leaving == 0.0 {
        // Nothing reflected was found here: the size of the scene is all there is to go by.
        let (_, radius) = scene.geometry.bounding_sphere();
        return SCORE_OF_A_HISTORY / (radius * radius).max(f64::MIN_POSITIVE);
    }
    // The median: a few receivers beside an edge must not raise the bound of all.
    let middle = found.len() / 2;
    let (_, illuminance, _) = found.select_nth_unstable_by(middle, f64::total_cmp);
    let flux = scene.sources.started();
    SCORE_OF_A_HISTORY * PI * *illuminance / (flux * leaving / arriving)
}

/// What a vertex reflects \[lm\].
fn reflected(scene: &Scene, v: &Vertex) -> Colour {
    v.weight * scene.reflectance(v.primitive, v.position).albedo(-v.w_in.dot(v.normal))
}

/// Indirect illuminance at `receiver` by plain local estimation, all vertices taken as matt \[lx\].
fn indirect(scene: &Scene, vertices: &[Vertex], receiver: &Receiver) -> f64 {
    let lifted = scene.geometry.lift(receiver.position, receiver.normal).as_vec3();
    let of_vertex = |v: &Vertex| {
        let way: DVec3 = receiver.position - v.position;
        let d2 = way.length_squared().max(f64::MIN_POSITIVE);
        let factor = way.dot(v.normal).max(0.0) * (-way.dot(receiver.normal)).max(0.0) / (d2 * d2);
        if factor <= 0.0 {
            return 0.0;
        }
        let from = scene.geometry.lift(v.position, v.normal).as_vec3();
        (reflected(scene, v) * scene.transmittance(from, lifted)).luminance() / PI * factor
    };
    vertices.iter().map(of_vertex).sum::<f64>() / TRAJECTORIES as f64
}
