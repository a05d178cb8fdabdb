//! What is said of several bins at once: mean, minimum and uniformity of a grid, "every point of this grid", the means
//! of regions, ratios. Here batch scores meet [`crate::tally::derived`], which knows how such intervals are made; here
//! are the words for how that was, and for why there is none.

use super::daylight::DaylightFactor;
use super::values::{Bin, SetValues, Status};
use crate::farm::merge::{Merged, SetResult};
use crate::farm::plan::Plan;
use crate::job::ReceiverKind;
use crate::tally::derived::{Bounded, Family, Series, family_quantile, ratio};
use crate::tally::health::{Common, Counted, Health, Mark, Signs, health};
use crate::tally::statistics::{Estimate, student_quantile, variance_of_variance};
use serde::Serialize;
use std::io;

const MEAN: &str = "mean over the points in each batch, Student's interval over the batches";
const MINIMUM: &str = "least lower and least upper end of intervals that hold for every point together (Bonferroni): \
                       conservative; the value is biased low, because noise chooses the least";
const UNIFORMITY: &str = "minimum over mean; least lower and least upper end of jackknife intervals of point over mean \
                          that hold for every point together (Bonferroni): conservative";
const REGION: &str = "mean over the pixels in each batch, Student's interval over the batches";
const RATIO: &str = "ratio of the means over the same batches, delete-one jackknife";

/// A number with its interval, how that was made, and why there is none.
#[derive(Debug, Serialize)]
pub(super) struct Quantity {
    pub value: f64,
    /// Absent where the interval is not symmetric.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub standard_error: Option<f64>,
    pub ci_lower: f64,
    pub ci_upper: f64,
    pub how: &'static str,
    #[serde(skip_serializing_if = "str::is_empty")]
    pub note: &'static str,
    /// Why the interval should not be trusted; empty when healthy.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub marks: Vec<&'static str>,
}

/// What is derived from one receiver set.
#[derive(Debug, Default, Serialize)]
pub(super) struct OfSet {
    /// Of a region.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interval: Option<Quantity>,
    /// Of a grid whose batches are kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub derived: Option<OfGrid>,
    /// Of a grid whose batches are kept, or a point, where the job asks for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub daylight_factor: Option<DaylightFactor>,
}

/// What is derived from a grid.
#[derive(Debug, Serialize)]
pub(super) struct OfGrid {
    /// Points with a receiver.
    pub points: usize,
    /// Standard errors by which an interval of one point lies about its value so that those of all points hold
    /// together.
    pub family_quantile: f64,
    pub mean: Quantity,
    pub min: Quantity,
    /// Uo = minimum / mean \[1\].
    pub uniformity: Quantity,
}

/// A `[[ratio]]` of the job \[1, or cd/m2 per lx\].
#[derive(Debug, Serialize)]
pub(super) struct OfRatio {
    pub name: String,
    pub numerator: String,
    pub denominator: String,
    #[serde(flatten)]
    pub quantity: Quantity,
}

/// What is derived from the set number `set` of the job, with `values` and `health` of its mean; `outdoor` is the illuminance over
/// which daylight factors are asked for \[lx\].
///
/// # Errors
/// Those of reading the bins.
pub(super) fn of_set(
    plan: &Plan,
    merged: &Merged,
    set: usize,
    values: &SetValues,
    health: Health,
    outdoor: Option<f64>,
) -> io::Result<OfSet> {
    let SetResult::Replicates { scores, fixed_direct } = &merged.sets[set] else { return Ok(OfSet::default()) };
    let confidence = plan.job.run.confidence;
    let family = Family::new(scores, fixed_direct);
    Ok(match values.shape.kind {
        ReceiverKind::Region => {
            let mean = Quantity::of_mean(&family.mean()?, confidence, REGION).marked(health);
            OfSet { interval: Some(mean), ..OfSet::default() }
        }
        ReceiverKind::Grid => {
            let of_grid = OfGrid::new(&family, merged.batches, confidence)?.marked(health, health_of_least(values)?);
            let daylight_factor = outdoor.map(|e| DaylightFactor::new(e, &of_grid.mean, Some(&of_grid.min)));
            OfSet { derived: Some(of_grid), daylight_factor, ..OfSet::default() }
        }
        ReceiverKind::Point => {
            let value = Quantity::of_mean(&family.mean()?, confidence, MEAN).marked(health);
            OfSet { daylight_factor: outdoor.map(|e| DaylightFactor::new(e, &value, None)), ..OfSet::default() }
        }
        ReceiverKind::Camera | ReceiverKind::Gonio => OfSet::default(),
    })
}

/// The marks of the mean over the bins of the set number `set`; of one bin they are its own.
///
/// # Errors
/// Those of reading the bins.
pub(super) fn health_of_mean(plan: &Plan, merged: &Merged, set: usize, values: &SetValues) -> io::Result<Health> {
    let SetResult::Replicates { scores, fixed_direct } = &merged.sets[set] else { return Ok(Health::default()) };
    if values.shape.bins() == 1 {
        return Ok(values.single()?.health.unwrap_or_default());
    }
    let family = Family::new(scores, fixed_direct);
    let mean = family.mean()?;
    let common = Common {
        histories: (merged.batches * plan.job.run.histories_per_batch) as f64,
        narrowest_lobe: plan.scene.narrowest_lobe,
    };
    let counted = Counted {
        estimate: Estimate::from_scores(mean.scores.iter().copied()).or_no_error(mean.informed),
        direct: f64::NAN,
        // What a single history gives a mean over bins is not known.
        peak: f64::NAN,
        vov: variance_of_variance(mean.scores.iter().copied()),
        caustic: family.caustic()?,
    };
    Ok(health(&Signs::of(&common, &counted, mean.fixed, None)))
}

/// The marks of the bin with the least value.
fn health_of_least(values: &SetValues) -> io::Result<Health> {
    let mut least: Option<(f64, Health)> = None;
    values.each(|_, bin| {
        if let Some(health) = bin.health
            && least.is_none_or(|(value, _)| bin.value.total_cmp(&value).is_lt())
        {
            least = Some((bin.value, health));
        }
        Ok(())
    })?;
    Ok(least.map(|(_, health)| health).unwrap_or_default())
}

/// The ratios of the job, in its order; `healths` are those of the means of its sets.
///
/// # Errors
/// Those of reading batch scores that are kept in a file.
pub(super) fn ratios(plan: &Plan, merged: &Merged, healths: &[Health]) -> io::Result<Vec<OfRatio>> {
    let shapes = plan.job.sets();
    let side = |name: &str| -> io::Result<(Series, Health)> {
        let place = shapes.iter().position(|s| s.name == name).expect("a ratio of a checked job is one of its sets");
        match &merged.sets[place] {
            SetResult::Replicates { scores, fixed_direct } => {
                Ok((Family::new(scores, fixed_direct).mean()?, healths[place]))
            }
            SetResult::Moments { .. } => unreachable!("a ratio of a checked job is one of sets that keep batches"),
        }
    };
    let of_ratio = |r: &crate::job::Ratio| {
        let ((above, its), (below, other)) = (side(&r.numerator)?, side(&r.denominator)?);
        Ok(OfRatio {
            name: r.name.clone(),
            numerator: r.numerator.clone(),
            denominator: r.denominator.clone(),
            quantity: Quantity::of_ratio(&above, &below, plan.job.run.confidence).marked(its.and(other)),
        })
    };
    plan.job.ratios.iter().map(of_ratio).collect()
}

/// Ends of the interval of `bin` that hold for every point of its grid together; `quantile` is that of the family.
pub(super) fn family_interval(bin: &Bin, quantile: f64) -> [f64; 2] {
    [bin.value - quantile * bin.standard_error, bin.value + quantile * bin.standard_error]
}

/// The quantile of the family of all points of `values` that have a receiver.
///
/// # Errors
/// Those of reading a map that is kept in a file.
pub(super) fn quantile_of(values: &SetValues, confidence: f64, batches: u64) -> io::Result<f64> {
    let mut points = 0;
    values.each(|_, bin| {
        points += usize::from(bin.status != Status::NoReceiver);
        Ok(())
    })?;
    Ok(family_quantile(confidence, points, batches))
}

impl Quantity {
    fn of_mean(series: &Series, confidence: f64, how: &'static str) -> Self {
        let estimate = series.estimate();
        Quantity::new(estimate, confidence, how, why_none(series))
    }

    fn of_ratio(numerator: &Series, denominator: &Series, confidence: f64) -> Self {
        let estimate = ratio(numerator, denominator, confidence);
        let note = [why_none(numerator), why_none(denominator), why_no_ratio(denominator, confidence)];
        Quantity::new(estimate, confidence, RATIO, first(note))
    }

    fn new(estimate: Estimate, confidence: f64, how: &'static str, note: &'static str) -> Self {
        let (ci_lower, ci_upper) = estimate.interval(student_quantile(confidence, estimate.n));
        let standard_error = Some(estimate.standard_error);
        Quantity { value: estimate.mean, standard_error, ci_lower, ci_upper, how, note, marks: Vec::new() }
    }

    fn of_least(least: Bounded, how: &'static str, note: &'static str) -> Self {
        let missing = least.low.is_nan() && note.is_empty();
        let note = if missing { "points without information" } else { note };
        let Bounded { value, low, high } = least;
        Quantity { value, standard_error: None, ci_lower: low, ci_upper: high, how, note, marks: Vec::new() }
    }

    /// The same with the marks of `health`.
    fn marked(self, health: Health) -> Self {
        Quantity { marks: health.marks().map(Mark::word).collect(), ..self }
    }
}

impl OfGrid {
    fn new(family: &Family, batches: u64, confidence: f64) -> io::Result<Self> {
        let mean = family.mean()?;
        let note = why_none(&mean);
        let of_ratio = first([note, why_no_ratio(&mean, confidence)]);
        Ok(OfGrid {
            points: family.len(),
            family_quantile: family_quantile(confidence, family.len(), batches),
            mean: Quantity::of_mean(&mean, confidence, MEAN),
            min: Quantity::of_least(family.minimum(confidence)?, MINIMUM, note),
            uniformity: Quantity::of_least(family.uniformity(confidence)?, UNIFORMITY, of_ratio),
        })
    }

    /// The same with the marks of the mean and of the least of the points.
    fn marked(self, of_mean: Health, of_least: Health) -> Self {
        OfGrid {
            mean: self.mean.marked(of_mean),
            min: self.min.marked(of_least),
            uniformity: self.uniformity.marked(of_mean.and(of_least)),
            ..self
        }
    }
}

/// Why the mean of `series` has no interval; empty where it has one.
fn why_none(series: &Series) -> &'static str {
    if series.fixed.is_nan() {
        "no receiver"
    } else if series.scores.len() < 2 {
        "an interval needs two batches"
    } else if series.estimate().standard_error.is_nan() {
        "no information"
    } else {
        ""
    }
}

/// Why nothing can be divided by `denominator`; empty where it can.
fn why_no_ratio(denominator: &Series, confidence: f64) -> &'static str {
    if denominator.is_clear_of_zero(confidence) { "" } else { "the interval of the denominator contains zero" }
}

/// The first note that says something.
fn first<const N: usize>(notes: [&'static str; N]) -> &'static str {
    notes.into_iter().find(|note| !note.is_empty()).unwrap_or("")
}
