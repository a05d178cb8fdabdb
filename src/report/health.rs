//! The health of intervals as files and terminals show it: marks counted, monitored receivers one by one.
//!
//! What is marked and why is decided in `tally::health`; here are the words.

use super::number::short;
use super::summary::SetSummary;
use super::values::SetValues;
use crate::farm::plan::Plan;
use crate::job::Estimator;
use crate::tally::health::checks::{CHECKS, Outcome, Snapshot};
use crate::tally::health::{Examined, Health, Mark};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io;

/// Monitored receivers beyond this number are left to `summary.json`.
const MOST_LINES: usize = 12;

/// A monitored receiver in `summary.json`.
#[derive(Debug, Serialize)]
pub(super) struct Monitored {
    pub set: String,
    pub column: u32,
    pub row: u32,
    /// Marks of its interval; empty when healthy.
    pub marks: Vec<&'static str>,
    /// Slope of the tail of single histories; above 3 the variance is finite.
    pub slope: Option<f64>,
    /// Largest total of a single history.
    pub largest: f64,
    /// Variance of the variance of all single histories; for diagnosis only.
    pub vov: f64,
    pub checks: BTreeMap<&'static str, Outcome>,
    pub snapshots: Vec<Snapshot>,
    #[serde(skip)]
    alone: bool,
}

impl Monitored {
    /// The monitored receivers of one set, those that do not exist left out.
    ///
    /// # Errors
    /// Those of reading their bins.
    pub fn all(values: &SetValues) -> io::Result<Vec<Monitored>> {
        let mut all = Vec::new();
        for examined in &values.monitored {
            let health = values.bin(examined.bin as usize)?.health;
            all.extend(health.map(|health| Monitored::new(values, examined, health)));
        }
        Ok(all)
    }

    fn new(values: &SetValues, examined: &Examined, health: Health) -> Self {
        let (shape, bin) = (&values.shape, examined.bin);
        Monitored {
            set: shape.name.clone(),
            column: bin % shape.width,
            row: bin / shape.width,
            marks: health.marks().map(Mark::word).collect(),
            slope: examined.slope,
            largest: examined.largest,
            vov: examined.vov(),
            checks: CHECKS.into_iter().zip(examined.checks).collect(),
            snapshots: examined.snapshots.clone(),
            alone: shape.bins() == 1,
        }
    }

    /// True when its own interval has marks; that batches are few is said of all at once.
    fn is_suspicious(&self) -> bool {
        self.marks.iter().any(|&word| word != Mark::FewBatches.word())
    }

    fn line(&self) -> String {
        let place = if self.alone { String::new() } else { format!(" [{}, {}]", self.column, self.row) };
        let slope = self.slope.map_or(String::new(), |s| format!("; slope of the tail {}", short(s, 3)));
        let failed: Vec<&str> = CHECKS.into_iter().filter(|c| self.checks[c] == Outcome::Failed).collect();
        let checks = if failed.is_empty() { String::new() } else { format!("; failed: {}", failed.join(", ")) };
        format!("{}{place}: its interval should not be trusted ({}{slope}{checks})", self.set, self.marks.join(", "))
    }
}

/// How many bins of a set have marks.
#[derive(Debug, Default)]
pub(super) struct Counts {
    by_mark: [usize; Mark::ALL.len()],
    /// With any mark.
    pub unhealthy: usize,
}

impl Counts {
    /// Takes in the next bin, None without a receiver.
    pub fn add(&mut self, health: Option<Health>) {
        let Some(health) = health.filter(|h| !h.is_healthy()) else { return };
        self.unhealthy += 1;
        self.by_mark.iter_mut().zip(Mark::ALL).for_each(|(n, mark)| *n += usize::from(health.has(mark)));
    }

    /// The number of each mark, by its word with underscores.
    pub fn named(&self) -> BTreeMap<String, usize> {
        Mark::ALL.into_iter().map(key).zip(self.by_mark).collect()
    }
}

/// A line for each set with intervals that should not be trusted, the points together, and one for each such
/// monitored receiver.
pub(super) fn lines(sets: &[SetSummary], monitored: &[Monitored]) -> Vec<String> {
    let (points, others): (Vec<&SetSummary>, Vec<&SetSummary>) = sets.iter().partition(|s| s.kind == "point");
    let mut lines: Vec<String> = others.iter().filter_map(|s| line(&s.name, &[s])).collect();
    lines.extend(line("points", &points));
    let suspicious: Vec<&Monitored> = monitored.iter().filter(|m| m.is_suspicious()).collect();
    lines.extend(suspicious.iter().take(MOST_LINES).map(|m| m.line()));
    if suspicious.len() > MOST_LINES {
        let more = suspicious.len() - MOST_LINES;
        lines.push(format!("{more} more monitored receivers should not be trusted: see summary.json"));
    }
    lines
}

/// The line for `sets` together, None when nothing is marked.
fn line(name: &str, sets: &[&SetSummary]) -> Option<String> {
    let unhealthy: usize = sets.iter().map(|s| s.unhealthy).sum();
    let bins: usize = sets.iter().map(|s| s.bins - s.inside).sum();
    let count = |mark: Mark| sets.iter().filter_map(|s| s.marks.get(&key(mark))).sum::<usize>();
    let counts = Mark::ALL.into_iter().map(|mark| (count(mark), mark.word()));
    let why: Vec<String> = counts.filter(|(n, _)| *n > 0).map(|(n, word)| format!("{n} {word}")).collect();
    (unhealthy > 0)
        .then(|| format!("{name}: {unhealthy} of {bins} intervals should not be trusted ({})", why.join(", ")))
}

fn key(mark: Mark) -> String {
    mark.word().replace(' ', "_")
}

/// True when the intervals are those of the plain local estimate.
pub(super) fn is_plain(plan: &Plan) -> bool {
    plan.job.transport.estimator == Estimator::Local && !plan.job.transport.bounded
}

/// What kind of estimate the numbers of `plan` are.
pub(super) fn estimate_label(plan: &Plan) -> &'static str {
    match plan.job.transport.estimator {
        Estimator::Local if plan.job.transport.bounded => "bounded",
        Estimator::Local => "plain local estimate: intervals near edges do not hold",
        Estimator::Reverse => "reverse",
        Estimator::DirectSimulation => "direct simulation",
    }
}
