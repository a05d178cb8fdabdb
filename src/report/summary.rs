//! `summary.json`: what a whole receiver set says in a line, the flux balance, timings, and a digest by which two
//! runs are compared. A number that is not finite is `null`.

use super::daylight::outdoor;
use super::derived::{OfRatio, OfSet, health_of_mean, of_set, ratios};
use super::health::{Counts, Monitored, estimate_label, is_plain, lines};
use super::stopping::StoppedBy;
use super::values::{Bin, SetValues, Status, kind_name, unit};
use crate::farm::merge::Merged;
use crate::farm::plan::{Input, Plan};
use crate::tally::health::{FEW_BATCHES, Health};
use crate::tally::statistics::{Estimate, figure_of_merit, select, student_quantile};
use crate::tally::{EveryBatch, FLUX_BINS};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::{Result, Write};

/// The content of `summary.json`.
#[derive(Debug, Serialize)]
pub(super) struct Summary {
    pub program: String,
    pub numerics: u32,
    pub name: String,
    pub plan_digest: String,
    pub job_file: Input,
    pub inputs: Vec<Input>,
    /// False when batches of the plan are missing.
    pub complete: bool,
    pub batches: u64,
    /// Half-open ranges of batches.
    pub missing_batches: Vec<[u64; 2]>,
    /// What ended the run; `null` without a goal.
    pub stopped_by: Option<StoppedBy>,
    pub histories_per_batch: u64,
    /// Trajectories traced for each history.
    pub thinning: u64,
    pub histories: u64,
    pub seed: u64,
    pub confidence: f64,
    /// What kind of estimate the numbers are.
    pub estimate: &'static str,
    pub sets: Vec<SetSummary>,
    pub ratios: Vec<OfRatio>,
    /// The bins whose single histories were watched.
    pub monitored: Vec<Monitored>,
    pub flux_lm: Flux,
    pub timings: Timings,
    /// With which the kernels of the workers ran; no number depends on them.
    pub instructions: Vec<String>,
    /// Of the scene, and of these results.
    pub warnings: Vec<String>,
    /// BLAKE3 of all numbers of all bins and of the flux balance: equal for equal results, whatever the time taken.
    pub results_digest: String,
}

/// One receiver set.
#[derive(Debug, Serialize)]
pub(super) struct SetSummary {
    pub name: String,
    pub kind: &'static str,
    pub unit: &'static str,
    pub bins: usize,
    /// Bins without receiver: inside a solid or behind a surface. They are in none of the statistics.
    pub inside: usize,
    /// Bins that no history reached.
    pub no_information: usize,
    /// Bins whose interval should not be trusted.
    pub unhealthy: usize,
    /// How many have each mark.
    pub marks: BTreeMap<String, usize>,
    /// Bins that are the same in every batch; they have no part in the statistics of errors.
    pub exact: usize,
    pub mean: f64,
    pub min: f64,
    pub max: f64,
    pub median_relative_error: f64,
    pub worst_relative_error: f64,
    /// 1 / (mean squared relative error x seconds of all workers) \[1/s\].
    pub figure_of_merit: f64,
    #[serde(flatten)]
    pub of_set: OfSet,
}

/// A number with its error.
#[derive(Debug, Serialize)]
pub(super) struct Term {
    pub mean: f64,
    pub standard_error: f64,
    pub ci_lower: f64,
    pub ci_upper: f64,
}

/// Where the emitted flux went \[lm\].
#[derive(Debug, Serialize)]
pub(super) struct Flux {
    pub emitted: Term,
    pub absorbed: Term,
    pub escaped: Term,
    pub lost: Term,
    pub met_delta: Term,
    /// emitted - absorbed - escaped - lost, with the error of the differences batch by batch.
    pub difference: Term,
    /// met_delta / emitted \[1\].
    pub met_delta_share: f64,
    pub met_delta_meaning: String,
}

/// How long it took.
#[derive(Debug, Serialize)]
pub(super) struct Timings {
    /// Time spent by all workers \[s\].
    pub worker_seconds: f64,
    pub histories_per_second: f64,
}

/// Gathers a [`Summary`] from one receiver set after the other.
pub(super) struct Collector<'a> {
    plan: &'a Plan,
    merged: &'a Merged,
    sets: Vec<SetSummary>,
    monitored: Vec<Monitored>,
    /// Of the means of the sets.
    healths: Vec<Health>,
    /// Over which daylight factors are asked for \[lx\].
    outdoor: Option<f64>,
    hasher: blake3::Hasher,
}

impl<'a> Collector<'a> {
    /// Nothing gathered yet.
    pub fn new(plan: &'a Plan, merged: &'a Merged) -> Self {
        let (sets, monitored, healths) = (Vec::new(), Vec::new(), Vec::new());
        let (outdoor, hasher) = (outdoor(&plan.job), blake3::Hasher::new());
        Collector { plan, merged, sets, monitored, healths, outdoor, hasher }
    }

    /// Takes in the next receiver set in job order.
    ///
    /// # Errors
    /// Those of reading a map that is kept in a file.
    pub fn add(&mut self, values: &SetValues) -> Result<()> {
        let place = self.sets.len();
        let health = health_of_mean(self.plan, self.merged, place, values)?;
        let derived = of_set(self.plan, self.merged, place, values, health, self.outdoor)?;
        self.healths.push(health);
        let shape = &values.shape;
        self.hasher.update(shape.name.as_bytes());
        self.hasher.update(&shape.width.to_le_bytes()).update(&shape.height.to_le_bytes());
        let mut seen = Seen::default();
        values.each(|_, bin| {
            seen.add(bin);
            self.hash(&bin.numbers());
            Ok(())
        })?;
        self.sets.push(SetSummary::new(values, seen, self.merged.seconds, derived)?);
        self.monitored.extend(Monitored::all(values)?);
        values.monitored.iter().for_each(|examined| self.hash(&examined.numbers()));
        Ok(())
    }

    /// The summary of all.
    ///
    /// # Errors
    /// Those of reading batch scores that are kept in a file.
    pub fn finish(mut self) -> Result<Summary> {
        let flux = Flux::new(self.merged, self.plan.job.run.confidence)?;
        for term in flux.terms() {
            self.hash(&[term.mean, term.standard_error, term.ci_lower, term.ci_upper]);
        }
        let (plan, merged, run) = (self.plan, self.merged, &self.plan.job.run);
        let histories = merged.batches * run.histories_per_batch;
        Ok(Summary {
            program: plan.program.clone(),
            numerics: plan.numerics,
            name: plan.name.clone(),
            plan_digest: plan.digest.clone(),
            job_file: plan.job_file.clone(),
            inputs: plan.inputs.clone(),
            complete: merged.missing.is_empty(),
            batches: merged.batches,
            missing_batches: merged.missing.iter().map(|r| [r.start, r.end]).collect(),
            stopped_by: StoppedBy::new(plan, merged),
            histories_per_batch: run.histories_per_batch,
            thinning: run.thinning,
            histories,
            seed: run.seed,
            confidence: run.confidence,
            estimate: estimate_label(plan),
            warnings: warnings(plan, merged, &flux, lines(&self.sets, &self.monitored)),
            sets: self.sets,
            ratios: ratios(plan, merged, &self.healths)?,
            monitored: self.monitored,
            flux_lm: flux,
            timings: Timings {
                worker_seconds: merged.seconds,
                histories_per_second: histories as f64 / merged.seconds,
            },
            instructions: merged.instructions.clone(),
            results_digest: self.hasher.finalize().to_hex().to_string(),
        })
    }

    fn hash(&mut self, numbers: &[f64]) {
        for x in numbers {
            // One NaN is as good as another, but their bits differ between operations.
            let x = if x.is_nan() { f64::NAN } else { *x };
            self.hasher.update(&x.to_bits().to_le_bytes());
        }
    }
}

/// What is seen of the bins of a set in passing.
struct Seen {
    inside: usize,
    no_information: usize,
    exact: usize,
    marks: Counts,
    values: Mean,
    min: f64,
    max: f64,
    /// Of the squares of the relative errors.
    squares: Mean,
    worst: f64,
}

impl Default for Seen {
    fn default() -> Self {
        let (min, max, worst) = (f64::NAN, f64::NAN, f64::NAN);
        let (marks, values, squares) = (Counts::default(), Mean::default(), Mean::default());
        Seen { inside: 0, no_information: 0, exact: 0, marks, values, min, max, squares, worst }
    }
}

impl Seen {
    fn add(&mut self, bin: &Bin) {
        self.inside += usize::from(bin.status == Status::NoReceiver);
        self.no_information += usize::from(bin.status == Status::NoInformation);
        self.exact += usize::from(bin.status == Status::Exact);
        self.marks.add(bin.health);
        if bin.value.is_finite() {
            self.values.add(bin.value);
            (self.min, self.max) = (self.min.min(bin.value), self.max.max(bin.value));
        }
        if let Some(error) = error_of(bin) {
            self.squares.add(error * error);
            self.worst = self.worst.max(error);
        }
    }
}

/// The relative error of a bin that has a part in the statistics of errors.
fn error_of(bin: &Bin) -> Option<f64> {
    Some(bin.relative_error).filter(|x| bin.status == Status::Estimated && x.is_finite())
}

/// A mean in the making.
#[derive(Default)]
struct Mean {
    count: u64,
    sum: f64,
}

impl Mean {
    fn add(&mut self, x: f64) {
        self.count += 1;
        self.sum += x;
    }

    /// NaN without any number.
    fn value(&self) -> f64 {
        self.sum / self.count as f64
    }
}

impl SetSummary {
    fn new(values: &SetValues, seen: Seen, seconds: f64, of_set: OfSet) -> Result<Self> {
        let errors = |take: &mut dyn FnMut(f64)| {
            values.each(|_, bin| {
                error_of(bin).into_iter().for_each(&mut *take);
                Ok(())
            })
        };
        let count = seen.squares.count;
        let median = if count == 0 { f64::NAN } else { select(count / 2, count, errors)? };
        Ok(SetSummary {
            name: values.shape.name.clone(),
            kind: kind_name(values.shape.kind),
            unit: unit(values.shape.kind),
            bins: values.shape.bins(),
            inside: seen.inside,
            no_information: seen.no_information,
            unhealthy: seen.marks.unhealthy,
            marks: seen.marks.named(),
            exact: seen.exact,
            mean: seen.values.value(),
            min: seen.min,
            max: seen.max,
            median_relative_error: median,
            worst_relative_error: seen.worst,
            figure_of_merit: figure_of_merit(seen.squares.value().sqrt(), seconds),
            of_set,
        })
    }
}

impl Term {
    fn new(estimate: Estimate, quantile: f64) -> Self {
        let (ci_lower, ci_upper) = estimate.interval(quantile);
        Term { mean: estimate.mean, standard_error: estimate.standard_error, ci_lower, ci_upper }
    }
}

impl Flux {
    fn new(merged: &Merged, confidence: f64) -> Result<Self> {
        let quantile = student_quantile(confidence, merged.batches);
        let mut estimates = Vec::with_capacity(FLUX_BINS.len());
        let mut differences = vec![0.0; merged.batches as usize];
        merged.flux.each(&mut |first, group| {
            for bin in 0..group.bins as usize {
                estimates.push(group.estimate(bin));
                let both = differences.iter_mut().zip(group.scores(bin));
                match FLUX_BINS[first + bin] {
                    "emitted" => both.for_each(|(difference, score)| *difference += score),
                    "absorbed" | "escaped" | "lost" => both.for_each(|(difference, score)| *difference -= score),
                    _ => {}
                }
            }
        })?;
        let [emitted, absorbed, escaped, lost, met_delta] = ["emitted", "absorbed", "escaped", "lost", "met_delta"]
            .map(|name| Term::new(estimates[place(name)], quantile));
        let difference = Estimate::from_scores(differences.iter().copied());
        let met_delta_share = met_delta.mean / emitted.mean;
        Ok(Flux {
            difference: Term::new(difference, quantile),
            met_delta_meaning: met_delta_meaning(emitted.mean, met_delta_share),
            met_delta_share,
            emitted,
            absorbed,
            escaped,
            lost,
            met_delta,
        })
    }

    fn terms(&self) -> [&Term; 6] {
        [&self.emitted, &self.absorbed, &self.escaped, &self.lost, &self.met_delta, &self.difference]
    }
}

/// Place of the flux bin `name`.
fn place(name: &str) -> usize {
    FLUX_BINS.iter().position(|&n| n == name).expect("a name of FLUX_BINS")
}

fn met_delta_meaning(emitted: f64, share: f64) -> String {
    if emitted == 0.0 {
        "no trajectory left a source: paths from the receivers keep no flux balance".to_owned()
    } else if share > 0.0 {
        format!(
            "{:.3} % of the emitted flux met a mirror: light whose last surface before a receiver is a mirror is \
             missing from these results (emission seen in a mirror by an eye is not)",
            100.0 * share
        )
    } else {
        "no flux met a mirror: nothing is missing for that reason".to_owned()
    }
}

fn warnings(plan: &Plan, merged: &Merged, flux: &Flux, health: Vec<String>) -> Vec<String> {
    let mut warnings = plan.scene.warnings.clone();
    if is_plain(plan) {
        warnings.push(estimate_label(plan).to_owned());
    }
    if !merged.missing.is_empty() {
        warnings.push(format!("incomplete: batches {} are missing", super::missing_text(merged)));
    }
    warnings.extend(StoppedBy::new(plan, merged).and_then(|by| by.warning(plan.job.run.confidence)));
    if merged.batches < FEW_BATCHES {
        warnings.push(format!("few batches: {} of the {FEW_BATCHES} that an interval needs", merged.batches));
    }
    if flux.lost.mean > 0.0 {
        warnings.push(format!("{:e} lm were stopped by a numerical guard", flux.lost.mean));
    }
    if flux.met_delta_share > 0.0 {
        warnings.push(flux.met_delta_meaning.clone());
    }
    warnings.extend(health);
    warnings
}

/// Writes `summary` as JSON.
pub(super) fn write_json(summary: &Summary, to: &mut impl Write) -> Result<()> {
    serde_json::to_writer_pretty(&mut *to, summary)?;
    writeln!(to)
}
