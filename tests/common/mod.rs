//! Shared by the tests: running a job in this process, the bound of a statistical test, reference tables.
#![allow(dead_code, unused_imports, reason = "each test binary uses its own part")]

pub mod battery;
pub mod scenes;

use lampyris::photometry::Colour;
use lampyris::scene::{Model, Scene};
pub use lampyris::tally::statistics::Estimate;
use lampyris::transport::connection::{self, Connected, Connectors, Link, Rule, Tile};
use lampyris::transport::receiver::Receiver;
pub use lampyris::validate::Comparison;
use lampyris::validate::Experiment;
pub use lampyris::validate::experiment::{estimates, flux};
use lampyris::validate::reference;
pub use lampyris::validate::reference::number;
use std::ops::Deref;

/// A job in its scene, ready to run in this process.
pub struct Case(Experiment);

impl Case {
    /// A job given as TOML, over `model`.
    pub fn new(toml: &str, model: Model) -> Case {
        Case(Experiment::new(toml, model).unwrap())
    }

    /// Bounds the kernel by `bound` at every receiver set, instead of as planned \[1/m2\].
    pub fn bound_all(&mut self, bound: f64) {
        self.0.bounds.fill(bound);
    }
}

impl Deref for Case {
    type Target = Experiment;

    fn deref(&self) -> &Experiment {
        &self.0
    }
}

/// All histories connected to `receivers`, each by itself, with the bound b and nothing else: no continuation.
pub fn connect(scene: &Scene, histories: &Connectors, bound: f64, receivers: &[Receiver]) -> Vec<Connected> {
    let link = |(owner, &receiver)| Link { owner, receiver, start: Colour::BLACK, watched: false };
    let tile = Tile::new(scene, (0..).zip(receivers).map(link).collect(), 0);
    let rule = Rule { bound, channels: 1, orders: 0..u32::MAX };
    connection::connect(scene, histories, 0..histories.histories(), &tile, &rule)
}

pub fn compare(name: impl ToString, estimate: Estimate, reference: f64) -> Comparison {
    Comparison::new(name, "", estimate, reference)
}

/// The estimate `a` against the reference `b` of the same quantity, which has an error of its own.
pub fn difference(name: impl ToString, a: Estimate, b: Estimate) -> Comparison {
    let standard_error = (a.standard_error * a.standard_error + b.standard_error * b.standard_error).sqrt();
    compare(name, Estimate { standard_error, ..a }, b.mean)
}

/// What is wrong with `c`, one of `comparisons`.
pub fn verdict(c: &Comparison, comparisons: usize) -> Option<String> {
    c.failure(comparisons)
}

/// Every comparison that fails.
pub fn failures(all: &[Comparison]) -> Vec<String> {
    all.iter().filter_map(|c| c.failure(all.len())).collect()
}

/// Fails with the list of all comparisons that do not hold.
#[track_caller]
pub fn assert_all(all: &[Comparison]) {
    assert!(!all.is_empty(), "nothing was compared");
    for c in all {
        // Shown by --nocapture: how far from the limits a passing test is.
        let share = 100.0 * c.estimate.standard_error / c.reference.abs();
        println!("{}: {} against {}, z = {:?}, error {share:.3} %", c.name, c.estimate.mean, c.reference, c.z());
    }
    let failures = failures(all);
    assert!(failures.is_empty(), "{} of {} comparisons fail:\n{}", failures.len(), all.len(), failures.join("\n"));
}

/// Rows of a reference table.
pub fn table(name: &str) -> Vec<reference::Row> {
    let table = match name {
        "sobolev_tables.csv" => reference::SOBOLEV,
        "sobolev_orders.csv" => reference::SOBOLEV_ORDERS,
        "sobolev_le_sd.csv" => reference::SOBOLEV_DEVIATIONS,
        "analytic_cases.csv" => reference::ANALYTIC,
        other => panic!("no table {other}"),
    };
    reference::rows(table)
}
