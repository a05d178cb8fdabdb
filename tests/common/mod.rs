//! Shared by the tests: running a job in this process, the bound of a statistical test, reference tables.
#![allow(dead_code, reason = "each test binary uses its own part")]

pub mod scenes;

use lampyris::farm::pilot::bounds;
use lampyris::farm::realization::Realization;
use lampyris::job::Job;
use lampyris::photometry::Colour;
use lampyris::scene::{Model, Scene};
pub use lampyris::tally::statistics::Estimate;
use lampyris::tally::statistics::student_quantile;
use lampyris::tally::{BatchScores, FLUX_BINS};
use lampyris::transport::connection::{self, Connected, Connectors, Link, Rule, Tile};
use lampyris::transport::receiver::Receiver;
use std::ops::Range;

/// Probability that a right program fails a whole test, over all its comparisons.
const FAMILY_WISE: f64 = 1e-6;
/// Largest standard error of a passing estimate, relative to the reference: a huge error bar must not pass.
const WORST_ERROR: f64 = 0.005;
/// What f32 coordinates may cost, relative to the reference.
const ROUNDING: f64 = 2e-6;

/// A job in its scene, ready to run in this process.
pub struct Case {
    pub job: Job,
    pub scene: Scene,
    /// b of the bounded kernel, as a plan holds it.
    pub bounds: Vec<f64>,
}

impl Case {
    /// A job given as TOML, over `model`.
    pub fn new(toml: &str, model: Model) -> Case {
        let named = if model.triangles.is_empty() { "" } else { "scene = \"in memory\"\n" };
        let job = Job::parse(&format!("{named}{toml}"), "test.toml").unwrap();
        let scene = Scene::new(model, &job).unwrap();
        let bounds = bounds(&job, &scene);
        Case { job, scene, bounds }
    }

    /// Scores of all batches, vertices limited to `orders`.
    pub fn batches(&self, orders: Range<u32>) -> (Vec<Vec<f64>>, Vec<BatchScores>) {
        let realization = Realization::new(&self.job, &self.scene, &self.bounds).with_orders(orders);
        let scores = (0..self.job.run.batches).map(|i| realization.batch(i)).collect();
        (realization.fixed_direct().to_vec(), scores)
    }

    /// Estimates of every bin of every receiver set, direct light included.
    pub fn estimates(&self) -> Vec<Vec<Estimate>> {
        let (fixed, batches) = self.batches(0..u32::MAX);
        estimates(&batches).iter().zip(fixed).map(|(set, fixed)| shifted(set, &fixed)).collect()
    }

    /// Estimates of the part of every bin that differs from batch to batch, vertices limited to `orders`.
    pub fn estimates_of_orders(&self, orders: Range<u32>) -> Vec<Vec<Estimate>> {
        estimates(&self.batches(orders).1)
    }
}

fn shifted(set: &[Estimate], fixed: &[f64]) -> Vec<Estimate> {
    set.iter().enumerate().map(|(i, e)| e.shifted(fixed.get(i).copied().unwrap_or(0.0))).collect()
}

/// Estimates of every bin of every receiver set from the scores of all batches.
pub fn estimates(batches: &[BatchScores]) -> Vec<Vec<Estimate>> {
    let sets = 0..batches[0].sets.len();
    let bin = |set: usize, i: usize| Estimate::from_scores(batches.iter().map(|b| b.sets[set].value[i]));
    sets.map(|set| (0..batches[0].sets[set].value.len()).map(|i| bin(set, i)).collect()).collect()
}

/// All histories connected to `receivers`, each by itself, with the bound b and nothing else: no continuation.
pub fn connect(scene: &Scene, histories: &Connectors, bound: f64, receivers: &[Receiver]) -> Vec<Connected> {
    let links = receivers.iter().enumerate().map(|(owner, &receiver)| Link { owner, receiver }).collect();
    let tile = Tile::new(scene, links, 0);
    let rule = Rule { bound, channels: 1, orders: 0..u32::MAX };
    let start = vec![Colour::BLACK; receivers.len()];
    let mut connected = vec![Connected::default(); receivers.len()];
    connection::connect(scene, histories, 0..histories.histories(), &[&tile], &rule, &start, &mut connected);
    connected
}

/// The estimate of one bin of the flux balance.
pub fn flux(batches: &[BatchScores], name: &str) -> Estimate {
    let bin = FLUX_BINS.iter().position(|&b| b == name).unwrap();
    Estimate::from_scores(batches.iter().map(|b| b.flux[bin]))
}

/// One comparison with a reference value.
pub struct Comparison {
    pub name: String,
    pub estimate: Estimate,
    pub reference: f64,
}

pub fn compare(name: impl ToString, estimate: Estimate, reference: f64) -> Comparison {
    Comparison { name: name.to_string(), estimate, reference }
}

/// What is wrong with `c`, one of `comparisons`: the estimate is too far off, or its error bar too wide.
pub fn verdict(c: &Comparison, comparisons: usize) -> Option<String> {
    let Estimate { n, mean, standard_error } = c.estimate;
    let quantile = student_quantile(1.0 - FAMILY_WISE / comparisons as f64, n);
    let size = c.reference.abs();
    let off = (mean - c.reference).abs();
    let near = off <= quantile * standard_error + ROUNDING * size;
    let narrow = standard_error <= WORST_ERROR * size;
    let z = (mean - c.reference) / standard_error;
    (!(near && narrow)).then(|| {
        let share = 100.0 * standard_error / size;
        format!("{}: {mean} against {}: z = {z:.2} (limit {quantile:.2}), error {share:.3} %", c.name, c.reference)
    })
}

/// Every comparison that fails.
pub fn failures(all: &[Comparison]) -> Vec<String> {
    all.iter().filter_map(|c| verdict(c, all.len())).collect()
}

/// Fails with the list of all comparisons that do not hold.
#[track_caller]
pub fn assert_all(all: &[Comparison]) {
    assert!(!all.is_empty(), "nothing was compared");
    for c in all {
        // Shown by --nocapture: how far from the limits a passing test is.
        let z = (c.estimate.mean - c.reference) / c.estimate.standard_error;
        println!("{}: {} against {}, z = {z:.2}", c.name, c.estimate.mean, c.reference);
    }
    let failures = failures(all);
    assert!(failures.is_empty(), "{} of {} comparisons fail:\n{}", failures.len(), all.len(), failures.join("\n"));
}

/// Rows of a reference table as maps from column to text.
pub fn table(name: &str) -> Vec<std::collections::HashMap<String, String>> {
    let path = format!("{}/tests/reference/{name}", env!("CARGO_MANIFEST_DIR"));
    let mut reader = csv::Reader::from_path(path).unwrap();
    reader.deserialize().map(|row| row.unwrap()).collect()
}

/// The number in a column of a row.
pub fn number(row: &std::collections::HashMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap()
}
