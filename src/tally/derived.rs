//! Quantities derived from several bins, with intervals that respect the correlation between them.
//!
//! All receivers see the same histories, so the errors of two bins are correlated, and adding them in quadrature is
//! wrong in either direction. Nothing here does: every quantity is first formed *within* a batch, or with one batch
//! left out, and its spread between batches is what counts. The batch stays the only unit of the variance.
//!
//! **Means** are linear in the scores: the mean of a set in each batch is one more batch score.
//!
//! **Smooth functions of means**, such as ratios, by the delete-one jackknife over the n batches, with theta_(b) the
//! statistic without batch b:
//!
//! ```text
//! se^2 = (n-1)/n sum over b of (theta_(b) - mean theta_(.))^2                                           (11.5)
//! ```
//!
//! The value is that of all batches, not corrected for its bias: this is of the order 1/n beside an error of the order
//! 1/sqrt(n), its correction adds variance, and a reader who divides the two printed means gets the printed ratio.
//!
//! **Everything at once**: m intervals hold together with the confidence c when each is taken at 1 - (1-c)/m
//! (Bonferroni), whatever the correlation.
//!
//! **Least of several**: the least estimate is biased low, because noise chooses it, and its jackknife is not
//! consistent: the minimum has no derivative where two bins tie, and the batch left out changes which is least. From
//! intervals \[l_i, u_i\] that hold together follows without any of this
//!
//! ```text
//! min l_i <= min of the true values <= min u_i                                                         (11.6)
//! ```
//!
//! for the least true value is some bin's, hence at least its l_i, and is at most every bin's, hence at most every u_i.
//! Such intervals are conservative: they cover with at least the confidence asked for, and are wider than need be.
//!
//! Uniformity Uo = least over mean: (11.6) on the ratios E_i/mean, each by the jackknife (the errors of the two partly
//! cancel). Where the interval of a denominator contains zero, a ratio has no bounded interval (Fieller): then
//! there is none, NaN. Fixed parts, the same in every batch, are added to means and have no error. What the bins
//! measure, this module does not know.

use super::statistics::{Estimate, student_quantile};
use super::student::tail_quantile;
use super::{EveryBatch, Replicates, informed};
use std::io;

/// One number a batch, and a constant that belongs to each of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Batch by batch, the part that differs.
    pub scores: Vec<f64>,
    /// The part known without error.
    pub fixed: f64,
    /// False when nothing is known about the error, see [`super::informed`].
    pub informed: bool,
}

/// A value with an interval that is not symmetric about it, and so without standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounded {
    /// The estimate.
    pub value: f64,
    /// Lower end of the interval; NaN where nothing is known.
    pub low: f64,
    /// Upper end of the interval; NaN where nothing is known.
    pub high: f64,
}

/// The bins of a set about which something is said at once: those that have a receiver.
pub struct Family<'a> {
    scores: &'a dyn EveryBatch,
    /// Number and fixed part of each.
    members: Vec<(usize, f64)>,
}

/// Two-sided factor of standard errors for one of `members` intervals over `n` batches that are to hold all together
/// with probability `confidence`. NaN below n = 2.
pub fn family_quantile(confidence: f64, members: usize, n: u64) -> f64 {
    tail_quantile(0.5 * (1.0 - confidence) / members.max(1) as f64, n)
}

/// The statistic of `n` batches with its error by equation (11.5); `statistic` is given the batch to leave out.
pub fn jackknife(n: usize, statistic: impl Fn(Option<usize>) -> f64) -> Estimate {
    let without = Estimate::from_scores((0..n).map(|batch| statistic(Some(batch))));
    // The standard error of the mean of the theta_(b) is sqrt(sum/(n(n-1))).
    let standard_error = without.standard_error * (n as f64 - 1.0);
    Estimate { n: n as u64, mean: statistic(None), standard_error }
}

/// The ratio of two means over the same batches. Its error is NaN where nothing is known about that of one of them, or the
/// interval of the denominator at `confidence` contains zero.
pub fn ratio(numerator: &Series, denominator: &Series, confidence: f64) -> Estimate {
    assert_eq!(numerator.scores.len(), denominator.scores.len(), "series of the same batches");
    let mut ratio = LeaveOneOut::new(numerator).over(&LeaveOneOut::new(denominator));
    if !numerator.informed || !denominator.is_clear_of_zero(confidence) {
        ratio.standard_error = f64::NAN;
    }
    ratio
}

/// The bounds of the least of several values from intervals that hold together, equation (11.6). One unknown lower
/// end leaves that of the least unknown; the known upper ends bound it all the same.
pub fn least(intervals: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    let narrower = |(low, high): (f64, f64), (l, h): (f64, f64)| {
        (if low.is_nan() || l.is_nan() { f64::NAN } else { low.min(l) }, high.min(h))
    };
    intervals.reduce(narrower).unwrap_or((f64::NAN, f64::NAN))
}

impl Series {
    /// The mean over the batches; its error is NaN without information.
    pub fn estimate(&self) -> Estimate {
        Estimate::from_scores(self.scores.iter().copied()).shifted(self.fixed).or_no_error(self.informed)
    }

    /// Whether the interval of the mean leaves zero out.
    pub fn is_clear_of_zero(&self, confidence: f64) -> bool {
        let (low, high) = self.estimate().interval(student_quantile(confidence, self.scores.len() as u64));
        low > 0.0 || high < 0.0
    }
}

/// The mean of a series, and its means with each of the batches left out.
struct LeaveOneOut {
    all: f64,
    without: Vec<f64>,
}

impl LeaveOneOut {
    fn new(series: &Series) -> Self {
        let n = series.scores.len() as f64;
        let sum: f64 = series.scores.iter().sum();
        let without = series.scores.iter().map(|x| series.fixed + (sum - x) / (n - 1.0)).collect();
        LeaveOneOut { all: series.fixed + sum / n, without }
    }

    fn at(&self, left_out: Option<usize>) -> f64 {
        left_out.map_or(self.all, |batch| self.without[batch])
    }

    /// The ratio of the two by the jackknife: time and memory in proportion to the batches.
    fn over(&self, denominator: &LeaveOneOut) -> Estimate {
        jackknife(self.without.len(), |left_out| self.at(left_out) / denominator.at(left_out))
    }
}

impl<'a> Family<'a> {
    /// The bins of `scores` of which `fixed` is the part that is the same in every batch: NaN for a bin without
    /// receiver, empty for zero everywhere.
    pub fn new(scores: &'a dyn EveryBatch, fixed: &[f64]) -> Self {
        let part = |bin: usize| (bin, fixed.get(bin).copied().unwrap_or(0.0));
        let members = (0..scores.bins()).map(part).filter(|(_, fixed)| !fixed.is_nan()).collect();
        Family { scores, members }
    }

    /// Number of bins with a receiver.
    pub fn len(&self) -> usize {
        self.members.len()
    }

    /// True when no bin has a receiver.
    pub fn is_empty(&self) -> bool {
        self.members.is_empty()
    }

    /// The mean over the bins, batch by batch; something is known of it where a history reached any of them.
    ///
    /// # Errors
    /// Those of reading batch scores that are kept in a file.
    pub fn mean(&self) -> io::Result<Series> {
        let count = self.members.len() as f64;
        // -0, because adding it changes no bit.
        let mut sums = vec![-0.0; self.scores.batches() as usize];
        let (mut existed, mut peak) = (0, 0.0f64);
        self.each(&mut |group, bin, _| {
            sums.iter_mut().zip(group.scores(bin)).for_each(|(sum, score)| *sum += score);
            existed = existed.max(group.existed[bin]);
            peak = peak.max(group.peak[bin]);
        })?;
        let fixed = self.members.iter().map(|(_, fixed)| fixed).sum::<f64>() / count;
        sums.iter_mut().for_each(|sum| *sum /= count);
        Ok(Series { scores: sums, fixed, informed: informed(existed, peak) })
    }

    /// The mean over the bins of the largest light of a batch that no bound holds, see [`super::Scores::caustic`].
    ///
    /// # Errors
    /// As [`Family::mean`].
    pub fn caustic(&self) -> io::Result<f64> {
        let mut sum = -0.0;
        self.each(&mut |group, bin, _| sum += group.caustic[bin])?;
        Ok(sum / self.members.len() as f64)
    }

    /// The least of the means of the bins, by equation (11.6).
    ///
    /// # Errors
    /// As [`Family::mean`].
    pub fn minimum(&self, confidence: f64) -> io::Result<Bounded> {
        self.bounded(confidence, |group, bin, fixed| group.estimate(bin).shifted(fixed))
    }

    /// The least of the means of the bins over the mean of all, by equation (11.6). No interval where that of the mean
    /// contains zero.
    ///
    /// # Errors
    /// As [`Family::mean`].
    pub fn uniformity(&self, confidence: f64) -> io::Result<Bounded> {
        let mean = self.mean()?;
        let denominator = LeaveOneOut::new(&mean);
        let share = |group: &Replicates, bin: usize, fixed: f64| {
            let informed = group.informed(bin);
            let series = Series { scores: group.scores(bin).collect(), fixed, informed };
            LeaveOneOut::new(&series).over(&denominator).or_no_error(informed)
        };
        let uniformity = self.bounded(confidence, share)?;
        if mean.is_clear_of_zero(confidence) {
            Ok(uniformity)
        } else {
            Ok(Bounded { low: f64::NAN, high: f64::NAN, ..uniformity })
        }
    }

    /// Gives each member to `take`: the scores of some bins, its number among them, its fixed part.
    fn each(&self, take: &mut dyn FnMut(&Replicates, usize, f64)) -> io::Result<()> {
        let mut members = self.members.iter().peekable();
        self.scores.each(&mut |first, group| {
            let end = first + group.bins as usize;
            while let Some((bin, fixed)) = members.next_if(|(bin, _)| *bin < end) {
                take(group, bin - first, *fixed);
            }
        })
    }

    fn bounded(&self, confidence: f64, estimate: impl Fn(&Replicates, usize, f64) -> Estimate) -> io::Result<Bounded> {
        let quantile = family_quantile(confidence, self.members.len(), self.scores.batches());
        let mut value = f64::NAN;
        let mut intervals = Vec::with_capacity(self.members.len());
        self.each(&mut |group, bin, fixed| {
            let estimate = estimate(group, bin, fixed);
            value = value.min(estimate.mean);
            intervals.push(estimate.interval(quantile));
        })?;
        let (low, high) = least(intervals.into_iter());
        Ok(Bounded { value, low, high })
    }
}
