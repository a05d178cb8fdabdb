//! From what a tally holds of a bin to the signs of its health, the same for the report and for measurements of coverage.

use super::checks::{CHECKS, Outcome, Snapshot, checks, snapshots};
use super::tail::tail_slope;
use crate::job::Sampling;
use crate::tally::statistics::{Estimate, variance_of_variance};
use crate::tally::{MomentBlock, Monitor, Replicates};

/// What is the same for all bins of a run.
#[derive(Clone, Copy, Debug)]
pub struct Common {
    /// Histories of all batches.
    pub histories: f64,
    /// alpha of the narrowest lobe in the scene.
    pub narrowest_lobe: f64,
}

/// What a tally says of the random part of a bin \[cd/m2 or lx, except where said\].
#[derive(Clone, Copy, Debug)]
pub struct Counted {
    /// Value, direct light that is the same in every batch left out.
    pub estimate: Estimate,
    /// Mean of the sampled direct light, contained in the value.
    pub direct: f64,
    /// Largest total of a single history, direct light at the receiver left out.
    pub peak: f64,
    /// Variance of the variance of the batch scores \[1\]; NaN where only moments are kept.
    pub vov: f64,
    /// Light that no bound holds, of the batch that has most of it.
    pub caustic: f64,
}

impl Counted {
    /// Bin `i` of a map of `batches`.
    pub fn of_moments(bins: &MomentBlock, i: usize, batches: u64) -> Self {
        Counted {
            estimate: bins.estimate(i, batches),
            direct: bins.direct[i],
            peak: bins.peak[i],
            vov: f64::NAN,
            caustic: bins.caustic[i],
        }
    }

    /// Bin `i` of a set that keeps its batches.
    pub fn of_replicates(scores: &Replicates, i: usize) -> Self {
        Counted {
            estimate: scores.estimate(i),
            direct: scores.direct_mean(i),
            peak: scores.peak[i],
            vov: variance_of_variance(scores.scores(i)),
            caustic: scores.caustic[i],
        }
    }

    /// Share of the largest of `histories` in the sum of all \[1\]; NaN where no history contributed.
    fn peak_share(&self, histories: f64) -> f64 {
        let sum = (self.estimate.mean - self.direct) * histories;
        // Without a contribution the difference above is rounding noise, so the largest history decides.
        if self.peak > 0.0 && sum > 0.0 { self.peak / sum } else { f64::NAN }
    }
}

/// What the single histories of one monitored bin say.
#[derive(Clone, Debug)]
pub struct Examined {
    /// Number of the bin in its set.
    pub bin: u32,
    /// Slope of the tail; None when too few histories are known.
    pub slope: Option<f64>,
    /// Largest total of a single history \[lx or cd/m2\]; NaN when none is known.
    pub largest: f64,
    /// In the order of [`CHECKS`].
    pub checks: [Outcome; CHECKS.len()],
    /// Through the second half of the run.
    pub snapshots: Vec<Snapshot>,
}

impl Examined {
    /// From `monitor`, with `fixed` the direct light that is the same in every batch.
    pub fn new(monitor: &Monitor, fixed: f64, sampling: Sampling) -> Self {
        let slope = tail_slope(&monitor.largest);
        let snapshots = snapshots(monitor, fixed);
        let checks = checks(&snapshots, slope, sampling);
        let largest = monitor.largest.first().copied().unwrap_or(f64::NAN);
        Examined { bin: monitor.bin, slope, largest, checks, snapshots }
    }

    /// How many of the first nine checks failed; the tenth has a mark of its own.
    pub fn failed_checks(&self) -> usize {
        self.checks[..CHECKS.len() - 1].iter().filter(|&&c| c == Outcome::Failed).count()
    }

    /// Variance of the variance of all single histories; NaN where it is not known.
    pub fn vov(&self) -> f64 {
        self.snapshots.last().map_or(f64::NAN, |s| s.vov)
    }

    /// All numbers in a fixed order, for a digest.
    pub fn numbers(&self) -> Vec<f64> {
        let of = |s: &Snapshot| [s.mean, s.relative_error, s.vov, s.figure_of_merit_per_history];
        let ends = [self.slope.unwrap_or(f64::NAN), self.largest];
        ends.into_iter().chain(self.snapshots.iter().flat_map(of)).collect()
    }
}

/// What the health of a bin follows from. A number that is not known is NaN, and sets no mark.
#[derive(Clone, Copy, Debug)]
pub struct Signs {
    /// Number of batches.
    pub batches: u64,
    /// False when nothing is known about the error.
    pub informed: bool,
    /// Standard error over mean \[1\]; 0 for a bin that is the same in every batch.
    pub relative_error: f64,
    /// Share of the largest history \[1\].
    pub peak: f64,
    /// Variance of the variance of the batch scores \[1\].
    pub vov: f64,
    /// Variance of the variance of single histories, of a monitored bin \[1\].
    pub history_vov: f64,
    /// Slope of the tail, of a monitored bin.
    pub slope: Option<f64>,
    /// Number of the first nine checks that failed, of a monitored bin.
    pub failed_checks: usize,
    /// Light that no bound holds, of the batch that has most of it \[standard errors\].
    pub caustic: f64,
    /// N alpha^2 of N histories and the narrowest lobe of the scene; 0 where there is a mirror.
    pub histories_in_lobe: f64,
}

impl Signs {
    /// Of a bin with `fixed` the direct light that is the same in every batch; `examined` if it is monitored.
    pub fn of(common: &Common, counted: &Counted, fixed: f64, examined: Option<&Examined>) -> Self {
        let estimate = counted.estimate.shifted(fixed);
        let Estimate { n, standard_error, .. } = estimate;
        Signs {
            batches: n,
            // A single batch tells a value, if no error.
            informed: n == 1 || !standard_error.is_nan(),
            // An exact zero has no error, where 0/0 would have no value.
            relative_error: if standard_error == 0.0 { 0.0 } else { estimate.relative_error() },
            peak: counted.peak_share(common.histories),
            vov: counted.vov,
            history_vov: examined.map_or(f64::NAN, Examined::vov),
            slope: examined.and_then(|e| e.slope),
            failed_checks: examined.map_or(0, Examined::failed_checks),
            caustic: counted.caustic / standard_error,
            histories_in_lobe: common.histories * common.narrowest_lobe * common.narrowest_lobe,
        }
    }
}
