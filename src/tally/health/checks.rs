//! The ten checks of a monitored bin, made at snapshots over the second half of its batches.
//!
//! They are MCNP's, put in terms of batches (docs/method.md, section 11). Means, R and figures of merit come from
//! batch scores; the variance of the variance (VOV) and the tail from single histories. Where MCNP asks for a quantity
//! that falls or stays the same, a run of some dozen batches would fail by chance: here R and the figure of merit may
//! deviate by what three standard deviations of normal batch scores explain, and are never held to more than MCNP asks
//! for. The limits of the VOV were set by trial on samples of known densities (`tests`), where exponential totals fail
//! each check in at most some percent of runs of 64 batches.
//!
//! | check | passed when |
//! |---|---|
//! | `mean_without_drift` | the means of the snapshots neither all rise nor all fall |
//! | `error_small` | R < 0.05 |
//! | `error_falls` | R falls from each snapshot to the next |
//! | `error_rate` | R sqrt(batches) is at the end what it was at half the run |
//! | `vov_small` | VOV < 0.1 |
//! | `vov_falls` | VOV never rises by more than a half from one snapshot to the next |
//! | `vov_rate` | VOV x histories is at the end at most twice what it was at half the run |
//! | `merit_constant` | the figure of merit of every snapshot is that of the last one |
//! | `merit_without_drift` | the figures of merit neither all rise nor all fall |
//! | `tail_steep` | the slope of the tail is above 3 |
//!
//! In a quasi-random batch the histories are not independent, and the power sums of single ones say nothing about
//! the error: only `error_small`, `error_rate` and `tail_steep` apply. The tail does, because each point of a
//! scrambled set is by itself uniformly distributed: single totals have the density that they have in random
//! sampling, and this density is what check 10 looks at. Passing all is necessary, not sufficient.

use super::SLOPE;
use crate::job::Sampling;
use crate::tally::monitor::{HistoryMoments, Monitor};
use crate::tally::statistics::{Estimate, figure_of_merit};
use serde::Serialize;

/// R of `error_small`: half of MCNP's limit, as for its point detectors.
pub const ERROR_LIMIT: f64 = 0.05;
/// VOV of `vov_small`.
pub const VOV_LIMIT: f64 = 0.1;
/// Rise of the VOV from one snapshot to the next that `vov_falls` lets pass.
pub const VOV_RISE: f64 = 1.5;
/// Rise of VOV x histories that `vov_rate` lets pass.
pub const VOV_GROWTH: f64 = 2.0;
/// Batches below which only the tail is looked at.
pub const FEWEST_BATCHES: u64 = 16;

/// Steps of the snapshots through the second half.
const STEPS: u64 = 10;
/// Standard deviations that chance is allowed.
const SPREAD: f64 = 3.0;

/// Names of the checks, in their order.
pub const CHECKS: [&str; 10] = [
    "mean_without_drift",
    "error_small",
    "error_falls",
    "error_rate",
    "vov_small",
    "vov_falls",
    "vov_rate",
    "merit_constant",
    "merit_without_drift",
    "tail_steep",
];

/// Checks that apply to quasi-random batches: 2, 4 and 10.
const QUASI_RANDOM: [usize; 3] = [1, 3, 9];

/// What a check says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Nothing suspicious.
    Passed,
    /// Suspicious.
    Failed,
    /// Cannot be said of such batches, or of so few.
    NotApplicable,
}

/// The state of a monitored bin after some of its batches.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Snapshot {
    /// Number of batches.
    pub batches: u64,
    /// Number of histories.
    pub histories: u64,
    /// Mean of the batch scores, with the part that is known without error \[lx or cd/m2\].
    pub mean: f64,
    /// Standard error over mean \[1\].
    pub relative_error: f64,
    /// Variance of the variance of single histories \[1\].
    pub vov: f64,
    /// Figure of merit per history, 1/(R^2 histories) \[1\].
    pub figure_of_merit_per_history: f64,
}

/// Batch counts of the snapshots of a run of `batches` batches: the second half in ten steps, each count once.
pub fn snapshot_counts(batches: u64) -> Vec<u64> {
    let count = |step: u64| batches - (batches / 2) / STEPS * step - (batches / 2) % STEPS * step / STEPS;
    let mut counts: Vec<u64> = (0..=STEPS).rev().map(count).filter(|&n| n >= 2).collect();
    counts.dedup();
    counts
}

/// The snapshots of `monitor`, with `offset` the part of its mean that is known without error \[lx or cd/m2\].
pub fn snapshots(monitor: &Monitor, offset: f64) -> Vec<Snapshot> {
    let mut histories = HistoryMoments::default();
    let mut taken = 0;
    let take = |count: u64| {
        let here = count as usize;
        histories = monitor.histories[taken..here].iter().fold(histories, |sum, next| sum.merged(*next));
        taken = here;
        let estimate = Estimate::from_scores(monitor.scores[..here].iter().copied()).shifted(offset);
        let relative_error = estimate.relative_error();
        Snapshot {
            batches: count,
            histories: histories.n,
            mean: estimate.mean,
            relative_error,
            vov: histories.variance_of_variance(),
            figure_of_merit_per_history: figure_of_merit(relative_error, histories.n as f64),
        }
    };
    snapshot_counts(monitor.scores.len() as u64).into_iter().map(take).collect()
}

/// The ten checks, in the order of [`CHECKS`].
pub fn checks(snapshots: &[Snapshot], slope: Option<f64>, sampling: Sampling) -> [Outcome; 10] {
    let tail = slope.map(|s| s > SLOPE);
    let over_time = match snapshots {
        [first, .., last] if last.batches >= FEWEST_BATCHES => judge(snapshots, first, last),
        _ => [None; 9],
    };
    std::array::from_fn(|i| match over_time.get(i).copied().unwrap_or(tail) {
        _ if sampling == Sampling::Rqmc && !QUASI_RANDOM.contains(&i) => Outcome::NotApplicable,
        Some(true) => Outcome::Passed,
        Some(false) => Outcome::Failed,
        None => Outcome::NotApplicable,
    })
}

/// Checks 1 to 9; None where a number is not known.
fn judge(snapshots: &[Snapshot], first: &Snapshot, last: &Snapshot) -> [Option<bool>; 9] {
    let pairs = || snapshots.windows(2).map(|w| (&w[0], &w[1]));
    let all = |of: fn(&Snapshot, &Snapshot) -> Option<bool>| {
        pairs().map(|(a, b)| of(a, b)).try_fold(true, |all, one| one.map(|one| all && one))
    };
    [
        known(last.mean).map(|_| !monotone(snapshots, |s| s.mean)),
        known(last.relative_error).map(|r| r < ERROR_LIMIT),
        all(error_falls),
        error_rate(first, last),
        known(last.vov).map(|v| v < VOV_LIMIT),
        all(|a, b| ratio(a.vov, b.vov).map(|rise| rise <= VOV_RISE)),
        ratio(first.vov * first.histories as f64, last.vov * last.histories as f64).map(|g| g <= VOV_GROWTH),
        snapshots.iter().map(|s| merit_same(s, last)).try_fold(true, |all, one| one.map(|one| all && one)),
        known(last.figure_of_merit_per_history).map(|_| !monotone(snapshots, |s| s.figure_of_merit_per_history)),
    ]
}

/// What chance makes of S_b^2 / S_a^2 at most, the variances over the first a and the first b = a + k batches \[1\]:
/// 1 + (z sqrt(2 k) + z^2) / sqrt(a b), of normal scores. The second term is the tail of a chi-square of few degrees
/// of freedom: without it every fourth healthy run of 16 batches would be suspected.
fn chance(a: &Snapshot, b: &Snapshot) -> f64 {
    let (a, b) = (a.batches as f64, b.batches as f64);
    1.0 + (SPREAD * (2.0 * (b - a).max(0.0)).sqrt() + SPREAD * SPREAD) / (a * b).sqrt()
}

fn error_falls(a: &Snapshot, b: &Snapshot) -> Option<bool> {
    let expected = (a.batches as f64 / b.batches as f64).sqrt();
    let allowed = expected * chance(a, b).sqrt();
    ratio(a.relative_error, b.relative_error).map(|r| r < allowed.max(1.0))
}

fn error_rate(a: &Snapshot, b: &Snapshot) -> Option<bool> {
    let scaled = |s: &Snapshot| s.relative_error * (s.batches as f64).sqrt();
    ratio(scaled(a), scaled(b)).map(|r| within(r * r, chance(a, b)))
}

fn merit_same(a: &Snapshot, b: &Snapshot) -> Option<bool> {
    ratio(a.figure_of_merit_per_history, b.figure_of_merit_per_history).map(|r| within(r, chance(a, b)))
}

/// Whether the ratio r is between 1/limit and limit.
fn within(r: f64, limit: f64) -> bool {
    r <= limit && r * limit >= 1.0
}

/// b/a where both are known and above zero.
fn ratio(a: f64, b: f64) -> Option<f64> {
    known(b / a).filter(|&r| r > 0.0)
}

fn known(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

/// True when `number` rises at every snapshot, or falls at every one.
fn monotone(snapshots: &[Snapshot], number: fn(&Snapshot) -> f64) -> bool {
    let pairs = || snapshots.windows(2).map(|w| (number(&w[0]), number(&w[1])));
    pairs().all(|(a, b)| a < b) || pairs().all(|(a, b)| a > b)
}
