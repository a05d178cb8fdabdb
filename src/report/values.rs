//! From a merged tally to the numbers that are written, once, for every file.
//!
//! A tally holds the random part only. Here the part known without error is added, Student's quantile for the
//! number of batches is applied, and every bin gets its [`Status`]. Goals are judged by the same estimates
//! ([`Estimate::with_fixed`]).

use super::health::Examined;
use crate::farm::merge::{Merged, SetResult};
use crate::farm::plan::Plan;
use crate::job::{ReceiverKind, SetShape};
use crate::tally::health::{Health, Signs, health};
use crate::tally::statistics::{Estimate, student_quantile, variance_of_variance};
use crate::tally::{MomentBlock, Monitor, Replicates};

/// What is known of a bin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Status {
    /// A value with an error; from a single batch the error is NaN.
    Estimated,
    /// The same in every batch: light seen without any reflection by a receiver.
    Exact,
    /// The receiver existed and no history reached it (or there is no batch at all): the error is NaN, never 0.
    NoInformation,
    /// No receiver there: inside a solid, or behind a surface. Every number is NaN.
    NoReceiver,
}

/// The numbers of one bin \[cd/m2 or lx, except where said\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bin {
    /// Mean of the batches, the fixed direct part included.
    pub value: f64,
    /// Of that mean.
    pub standard_error: f64,
    /// Lower end of the interval, not clamped at 0.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
    /// Direct light: the fixed part and the mean of the sampled one; contained in `value`.
    pub direct: f64,
    /// Largest single history over the sum of all \[1\], direct light at the receiver left out.
    pub peak: f64,
    /// Variance of the variance of the batch scores \[1\]; NaN where only moments are kept.
    pub vov: f64,
    /// Light that no bound holds, of the batch that has most of it \[cd/m2 or lx\].
    pub caustic: f64,
    /// Linear Rec.709 whose luminance is `value`.
    pub colour: [f64; 3],
    /// What is known.
    pub status: Status,
    /// Why the interval should not be trusted; None without receiver.
    pub health: Option<Health>,
}

impl Bin {
    fn unknown(status: Status) -> Self {
        let nan = f64::NAN;
        Bin {
            value: nan,
            standard_error: nan,
            low: nan,
            high: nan,
            direct: nan,
            peak: nan,
            vov: nan,
            caustic: nan,
            colour: [nan; 3],
            status,
            health: None,
        }
    }

    /// Standard error over the size of the value \[1\]; NaN where nothing is known.
    pub fn relative_error(&self) -> f64 {
        // An exact zero has no error, where 0/0 would have no value.
        if self.standard_error == 0.0 { 0.0 } else { self.standard_error / self.value.abs() }
    }

    /// All numbers in a fixed order, for a digest; caustic light is part of the health alone.
    pub fn numbers(&self) -> [f64; 11] {
        let [r, g, b] = self.colour;
        let health = self.health_code();
        [self.value, self.standard_error, self.low, self.high, self.direct, self.peak, self.vov, r, g, b, health]
    }

    /// Sum of the codes of its marks; NaN without receiver.
    pub fn health_code(&self) -> f64 {
        self.health.map_or(f64::NAN, |h| f64::from(h.code()))
    }
}

/// The numbers of one receiver set.
pub(super) struct SetValues {
    /// Name, kind and size.
    pub shape: SetShape,
    /// Row by row.
    pub bins: Vec<Bin>,
    /// The monitored bins, in ascending order.
    pub monitored: Vec<Examined>,
}

impl SetValues {
    /// The numbers of the receiver set `shape` of which `set` is the result and `monitors` are its monitored bins.
    pub fn new(plan: &Plan, merged: &Merged, shape: &SetShape, set: &SetResult, monitors: &[Monitor]) -> Self {
        let batches = merged.batches;
        let run = &plan.job.run;
        let (SetResult::Moments { fixed_direct, .. } | SetResult::Replicates { fixed_direct, .. }) = set;
        let fixed = |bin: u32| fixed_direct.get(bin as usize).copied().unwrap_or(0.0);
        let examine = |m: &Monitor| Examined::new(m, fixed(m.bin), run.sampling);
        let monitored: Vec<Examined> = monitors.iter().map(examine).collect();
        let rule = Rule {
            batches,
            quantile: student_quantile(run.confidence, batches),
            histories: batches as f64 * run.histories_per_batch as f64,
            narrowest_lobe: plan.scene.narrowest_lobe,
        };
        let bins = match set {
            SetResult::Moments { bins, .. } => {
                assert_eq!(bins.len(), shape.bins(), "the result of another set");
                let raw = (0..bins.len()).map(|i| Raw::from_moments(bins, i, batches));
                rule.apply(raw, fixed_direct, &monitored)
            }
            SetResult::Replicates { scores, .. } => {
                assert!(scores.has_shape(shape.bins(), batches), "the result of another set");
                let raw = (0..shape.bins()).map(|i| Raw::from_replicates(scores, i));
                rule.apply(raw, fixed_direct, &monitored)
            }
        };
        SetValues { shape: shape.clone(), bins, monitored }
    }

    /// All receiver sets of `plan`, one at a time.
    pub fn all<'a>(plan: &'a Plan, merged: &'a Merged) -> impl Iterator<Item = SetValues> + 'a {
        let shapes = plan.job.sets();
        let lengths = [merged.sets.len(), merged.monitors.len()];
        assert_eq!(lengths, [shapes.len(); 2], "a result for each receiver set");
        let results = merged.sets.iter().zip(&merged.monitors);
        let values =
            |(shape, (set, monitors)): (SetShape, (_, &Vec<_>))| SetValues::new(plan, merged, &shape, set, monitors);
        shapes.into_iter().zip(results).map(values)
    }
}

/// The unit of what a receiver of this kind measures.
pub(super) fn unit(kind: ReceiverKind) -> &'static str {
    match kind {
        ReceiverKind::Camera | ReceiverKind::Gonio | ReceiverKind::Region => "cd/m2",
        ReceiverKind::Grid | ReceiverKind::Point => "lx",
    }
}

/// The word for a kind of receiver set, as in a job file.
pub(super) fn kind_name(kind: ReceiverKind) -> &'static str {
    match kind {
        ReceiverKind::Camera => "camera",
        ReceiverKind::Gonio => "gonio",
        ReceiverKind::Grid => "grid",
        ReceiverKind::Point => "point",
        ReceiverKind::Region => "region",
    }
}

/// What a tally says of the random part of a bin.
struct Raw {
    estimate: Estimate,
    direct: f64,
    peak: f64,
    vov: f64,
    caustic: f64,
    colour: Option<[f64; 3]>,
}

impl Raw {
    fn from_moments(bins: &MomentBlock, i: usize, batches: u64) -> Self {
        Raw {
            estimate: bins.estimate(i, batches),
            direct: bins.direct[i],
            peak: bins.peak[i],
            vov: f64::NAN,
            caustic: bins.caustic[i],
            colour: bins.colour.get(i).copied(),
        }
    }

    fn from_replicates(scores: &Replicates, i: usize) -> Self {
        Raw {
            estimate: scores.estimate(i),
            direct: scores.direct_mean(i),
            peak: scores.peak[i],
            vov: variance_of_variance(scores.scores(i)),
            caustic: scores.caustic[i],
            colour: None,
        }
    }
}

/// What is the same for all bins of a set.
struct Rule {
    batches: u64,
    quantile: f64,
    /// Histories of all batches.
    histories: f64,
    /// alpha of the narrowest lobe in the scene.
    narrowest_lobe: f64,
}

impl Rule {
    fn apply(&self, raw: impl Iterator<Item = Raw>, fixed_direct: &[f64], monitored: &[Examined]) -> Vec<Bin> {
        let known = |(i, raw): (usize, Raw)| {
            let examined = monitored.binary_search_by_key(&i, |e| e.bin as usize).ok().map(|at| &monitored[at]);
            let mut bin = self.bin(&raw, fixed_direct, i);
            bin.health = (bin.status != Status::NoReceiver).then(|| self.health(&bin, examined));
            bin
        };
        let bins: Vec<Bin> = raw.enumerate().map(known).collect();
        assert!(fixed_direct.is_empty() || fixed_direct.len() == bins.len(), "direct light of another set");
        bins
    }

    fn bin(&self, raw: &Raw, fixed_direct: &[f64], i: usize) -> Bin {
        let Some(estimate) = raw.estimate.with_fixed(fixed_direct, i) else {
            return Bin::unknown(Status::NoReceiver);
        };
        if estimate.n == 0 {
            return Bin::unknown(Status::NoInformation);
        }
        let fixed = fixed_direct.get(i).copied().unwrap_or(0.0);
        let (low, high) = estimate.interval(self.quantile);
        Bin {
            value: estimate.mean,
            standard_error: estimate.standard_error,
            low,
            high,
            direct: fixed + raw.direct,
            peak: self.peak(raw),
            vov: raw.vov,
            caustic: raw.caustic,
            // Fixed light has no colour of its own in a tally: added as grey it keeps the luminance right.
            colour: raw.colour.map_or([estimate.mean; 3], |c| c.map(|x| x + fixed)),
            status: status(estimate),
            health: None,
        }
    }

    /// The marks of an existing bin.
    fn health(&self, bin: &Bin, examined: Option<&Examined>) -> Health {
        health(&Signs {
            batches: self.batches,
            informed: bin.status != Status::NoInformation,
            relative_error: bin.relative_error(),
            peak: bin.peak,
            vov: bin.vov,
            history_vov: examined.map_or(f64::NAN, Examined::vov),
            slope: examined.and_then(|e| e.slope),
            failed_checks: examined.map_or(0, Examined::failed_checks),
            caustic: bin.caustic / bin.standard_error,
            histories_in_lobe: self.histories * self.narrowest_lobe * self.narrowest_lobe,
        })
    }

    /// Share of the largest history in the sum of all; NaN where no history contributed.
    fn peak(&self, raw: &Raw) -> f64 {
        let sum = (raw.estimate.mean - raw.direct) * self.histories;
        // Without a contribution the difference above is rounding noise, so the largest history decides.
        if raw.peak > 0.0 && sum > 0.0 { raw.peak / sum } else { f64::NAN }
    }
}

fn status(estimate: Estimate) -> Status {
    match estimate {
        Estimate { n: 1, .. } => Status::Estimated,
        Estimate { standard_error, .. } if standard_error.is_nan() => Status::NoInformation,
        Estimate { standard_error: 0.0, .. } => Status::Exact,
        _ => Status::Estimated,
    }
}
