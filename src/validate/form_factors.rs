//! Form factors: what share of the light that leaves one rectangle arrives at another.
//!
//! Two readings: the flux that histories carry over, and the mean of exact points by a Gauss rule.

use super::closed_forms::{parallel_rectangles, perpendicular_squares};
use super::experiment::{Experiment, flux};
use super::scenes::{add_quad, lambert, point, run};
use super::{Case, Comparison, Theme};
use crate::error::Result;
use crate::math::{DVec3, PI};
use crate::scene::Model;
use crate::tally::BatchScores;
use crate::tally::statistics::Estimate;

const THEME: Theme = Theme("Form factors");

/// The cases, in order.
pub(super) fn cases() -> Vec<Case> {
    let reference = "double area integral in closed form, times the flux of the emitter";
    vec![
        THEME.case("form-factor/parallel", "rectangles that face each other", reference, parallel),
        THEME.case("form-factor/perpendicular", "unit squares with a common edge", reference, perpendicular),
    ]
}

/// Flux from an emitter of 1 cd/m2 that a black rectangle absorbs; both as origin, u, v \[lm\].
fn carried(emitter: [DVec3; 3], absorber: [DVec3; 3], points: &str) -> Result<Vec<BatchScores>> {
    let mut model = Model::default();
    let ([a, u, v], [b, p, q]) = (emitter, absorber);
    add_quad(&mut model, a, u, v, lambert(0.0, 1.0));
    add_quad(&mut model, b, p, q, lambert(0.0, 0.0));
    Ok(Experiment::new(&(run(8192, 32) + points), model)?.batches(0..u32::MAX).1)
}

fn parallel() -> Result<Vec<Comparison>> {
    let mut all = Vec::new();
    for (a, b) in [(1.0, 1.0), (2.0, 3.0)] {
        let (u, v) = (DVec3::X * a, DVec3::Z * b);
        let floor = [DVec3::ZERO, v, u];
        let (meters, weights) = wall_meters(&[floor]);
        let batches = carried([DVec3::Y, u, v], floor, &meters)?;
        let exact = PI * a * b * parallel_rectangles(a, b, 1.0);
        all.push(Comparison::new(format!("{a} x {b} m, flux absorbed"), "lm", flux(&batches, "absorbed"), exact));
        let mean = mean_of_meters(&batches, &weights);
        all.push(Comparison::new(format!("{a} x {b} m, mean illuminance"), "lx", mean, exact / (a * b)).within(1e-4));
    }
    Ok(all)
}

fn perpendicular() -> Result<Vec<Comparison>> {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let meter = point("unused", [0.5, 0.0, 0.5], y.to_array());
    let batches = carried([DVec3::ZERO, x, y], [DVec3::ZERO, z, x], &meter)?;
    Ok(vec![Comparison::new("flux absorbed", "lm", flux(&batches, "absorbed"), PI * perpendicular_squares())])
}

/// Nodes and weights of the Gauss-Legendre rule with six points on the unit interval.
fn gauss() -> [(f64, f64); 6] {
    let (a, b, c) = (0.932_469_514_203_152, 0.661_209_386_466_264_5, 0.238_619_186_083_196_9);
    let (wa, wb, wc) = (0.171_324_492_379_170_4, 0.360_761_573_048_138_6, 0.467_913_934_572_691);
    [(-a, wa), (-b, wb), (-c, wc), (c, wc), (b, wb), (a, wa)].map(|(x, w)| (0.5 + 0.5 * x, 0.5 * w))
}

/// Lux-meters at the nodes of every wall (origin, u, v; all of one area, facing u x v), and the weight of each.
pub(super) fn wall_meters(walls: &[[DVec3; 3]]) -> (String, Vec<f64>) {
    let mut toml = String::new();
    let mut weights = Vec::new();
    for &[origin, u, v] in walls {
        for (a, wa) in gauss() {
            for (b, wb) in gauss() {
                let name = format!("p{}", weights.len());
                toml += &point(&name, (origin + a * u + b * v).to_array(), u.cross(v).to_array());
                weights.push(wa * wb / walls.len() as f64);
            }
        }
    }
    (toml, weights)
}

/// Mean over the walls of what differs from batch to batch \[lx\].
pub(super) fn mean_of_meters(batches: &[BatchScores], weights: &[f64]) -> Estimate {
    let of_batch = |b: &BatchScores| b.sets.iter().zip(weights).map(|(s, w)| w * s.value[0]).sum::<f64>();
    Estimate::from_scores(batches.iter().map(of_batch))
}
