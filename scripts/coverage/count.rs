//! How often intervals cover the truth, over many replicates, and whether that is what they promise.
//!
//! ```text
//! holds  <=>  the 99 % binomial (Wilson) interval of the coverage meets [0.94, 0.96], and the coverage is in [0.93, 0.97]
//!             (intervals that are conservative by construction: from below alone), and |mean - truth| <= 3 standard errors
//! ```

use super::replicate::{Kind, Reading, Replicate};
use lampyris::tally::health::{Mark, Signs, health};
use lampyris::tally::statistics::Estimate;
use lampyris::validate::experiment::Experiment;
use rayon::prelude::*;

/// Two-sided 99 % normal quantile.
const Z99: f64 = 2.5758;

/// A quantity with its truth: one number, or one for each bin.
#[derive(Clone, Debug)]
pub struct Quantity {
    pub name: String,
    pub kind: Kind,
    pub truth: Vec<f64>,
    /// Standard error of the truth where it comes from a long run; 0 where it is exact.
    pub truth_error: f64,
}

/// What the replicates say of a quantity.
pub struct Counted {
    pub case: String,
    pub quantity: Quantity,
    pub readings: Vec<Reading>,
    histories_per_batch: f64,
}

/// Reads the `quantities` from the replicates of `experiment` with the seeds 1 to `replicates`.
pub fn count(case: &str, experiment: &Experiment, quantities: Vec<Quantity>, replicates: u64) -> Vec<Counted> {
    let read = |seed: u64| -> Vec<Reading> {
        let replicate = Replicate::new(experiment, seed);
        quantities.iter().map(|q| replicate.read(&q.kind)).collect()
    };
    let all: Vec<Vec<Reading>> = (1..=replicates).into_par_iter().map(read).collect();
    let histories_per_batch = experiment.job.run.histories_per_batch as f64;
    let of = |(i, quantity): (usize, Quantity)| {
        let readings = all.iter().map(|r| r[i].clone()).collect();
        Counted { case: case.to_owned(), quantity, readings, histories_per_batch }
    };
    quantities.clone().into_iter().enumerate().map(of).collect()
}

/// Wilson's 99 % interval of a share of `hits` in `trials`.
pub fn wilson(hits: usize, trials: usize) -> (f64, f64) {
    let (n, z2) = (trials as f64, Z99 * Z99);
    let p = hits as f64 / n;
    let middle = (p + 0.5 * z2 / n) / (1.0 + z2 / n);
    let half = Z99 * (p * (1.0 - p) / n + 0.25 * z2 / (n * n)).sqrt() / (1.0 + z2 / n);
    (middle - half, middle + half)
}

pub fn square(x: f64) -> f64 {
    x * x
}

pub fn is_marked(signs: &[Signs]) -> bool {
    signs.iter().any(|s| !health(s).is_healthy())
}

impl Counted {
    /// Head of the table of [`Counted::row`].
    pub const HEAD: &str = "| case | quantity | mean / truth (standard error) | z | sd of a history | half-width | coverage | 99 % | marked | coverage, unmarked | verdict |\n|---|---|---|---|---|---|---|---|---|---|---|";

    pub fn covers(&self, reading: &Reading) -> bool {
        let inside = |(&(_, low, high), &truth): (&(f64, f64, f64), &f64)| low <= truth && truth <= high;
        reading.intervals.iter().zip(self.quantity.truth.iter().cycle()).all(inside)
    }

    fn hits(&self) -> usize {
        self.readings.iter().filter(|r| self.covers(r)).count()
    }

    /// Mean of the values over the truth; of several bins their mean.
    fn mean(&self) -> Estimate {
        let truth = self.quantity.truth.iter().sum::<f64>() / self.quantity.truth.len() as f64;
        let value = |r: &Reading| r.intervals.iter().map(|i| i.0).sum::<f64>() / r.intervals.len() as f64 / truth;
        Estimate::from_scores(self.readings.iter().map(value))
    }

    /// Standard errors between the mean and the truth, that of the truth included.
    fn z(&self) -> f64 {
        let mean = self.mean();
        let truth_error = self.quantity.truth_error / self.quantity.truth[0];
        (mean.mean - 1.0) / (square(mean.standard_error) + square(truth_error)).sqrt()
    }

    /// Whether the coverage is what was promised.
    pub fn coverage_holds(&self) -> bool {
        let (hits, n) = (self.hits(), self.readings.len());
        let (low, high) = wilson(hits, n);
        let coverage = hits as f64 / n as f64;
        let above = high >= 0.94 && coverage >= 0.93;
        above && (self.quantity.kind.is_conservative() || (low <= 0.96 && coverage <= 0.97))
    }

    /// Whether the mean is that of the truth; the least of several is biased by selection.
    fn mean_holds(&self) -> bool {
        let selected = matches!(self.quantity.kind, Kind::Minimum(_) | Kind::Uniformity(_));
        selected || self.z().abs() <= 3.0
    }

    /// Share of the replicates in which `mark` is set on a bin concerned.
    pub fn share_of(&self, mark: Mark) -> f64 {
        let set = |r: &&Reading| r.signs.iter().any(|s| health(s).has(mark));
        self.readings.iter().filter(set).count() as f64 / self.readings.len() as f64
    }

    fn verdict(&self) -> &'static str {
        match (self.coverage_holds(), self.mean_holds()) {
            (true, true) => "holds",
            (true, false) => "FAILS: mean",
            (false, true) => "FAILS: coverage",
            (false, false) => "FAILS: coverage, mean",
        }
    }

    /// A line of the table.
    pub fn row(&self) -> String {
        let n = self.readings.len();
        let (hits, mean) = (self.hits(), self.mean());
        let (low, high) = wilson(hits, n);
        let width = |r: &Reading| r.intervals.iter().map(|i| i.2 - i.1).sum::<f64>() / r.intervals.len() as f64;
        let truth = self.quantity.truth.iter().sum::<f64>() / self.quantity.truth.len() as f64;
        let half = 0.5 * self.readings.iter().map(width).sum::<f64>() / n as f64 / truth;
        let batches = self.readings.iter().map(|r| r.batches as f64).sum::<f64>() / n as f64;
        let sd = mean.standard_error * (n as f64 * batches * self.histories_per_batch).sqrt();
        let unmarked: Vec<&Reading> = self.readings.iter().filter(|r| !is_marked(&r.signs)).collect();
        let covered = unmarked.iter().filter(|r| self.covers(r)).count() as f64 / unmarked.len() as f64;
        format!(
            "| {} | {} | {:.5} ({:.5}) | {:+.2} | {sd:.3} | {:.2} % | {:.4} | {low:.3} .. {high:.3} | {:.1} % | {} | {} |",
            self.case,
            self.quantity.name,
            mean.mean,
            mean.standard_error,
            self.z(),
            100.0 * half,
            hits as f64 / n as f64,
            100.0 * (n - unmarked.len()) as f64 / n as f64,
            if unmarked.is_empty() { "-".to_owned() } else { format!("{covered:.3} of {}", unmarked.len()) },
            self.verdict(),
        )
    }
}
