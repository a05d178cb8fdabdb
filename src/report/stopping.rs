//! What ended a run with a goal, for `summary.json` and for eyes.

use super::number::{percent, short};
use crate::farm::merge::Merged;
use crate::farm::merge::goal::Stopped;
use crate::farm::plan::Plan;
use serde::Serialize;

/// `stopped_by` of the summary.
#[derive(Debug, Serialize)]
pub(super) struct StoppedBy {
    /// `goal`, `limit`, or `nothing`: the run is unfinished.
    pub what: &'static str,
    /// Batches of these results.
    pub batches: u64,
    /// Number of the look at which the goal was reached, from 1.
    pub look: Option<usize>,
    /// The goal: half the width of the interval over the mean \[1\].
    pub relative_half_width: f64,
    /// Share of the bins of each set that must reach it \[1\].
    pub share: f64,
    /// Names of the sets that must reach it; empty for all.
    pub receivers: Vec<String>,
    pub max_batches: u64,
    /// Every look so far.
    pub looks: Vec<LookSummary>,
}

/// One look.
#[derive(Debug, Serialize)]
pub(super) struct LookSummary {
    pub batches: u64,
    /// The smallest goal that would have been reached \[1\]; null where too many bins had no information.
    pub relative_half_width: f64,
    /// The set that needs it.
    pub set: String,
}

impl StoppedBy {
    /// None where the job has no goal.
    pub fn new(plan: &Plan, merged: &Merged) -> Option<Self> {
        let stop = plan.job.stop.clone()?;
        let (what, look) = match merged.stopped {
            Some(Stopped::GoalReached { .. }) => ("goal", Some(merged.looks.len())),
            Some(Stopped::Limit) => ("limit", None),
            None => ("nothing", None),
        };
        let looks = merged.looks.iter().map(|look| LookSummary {
            batches: look.batches,
            relative_half_width: look.relative_half_width,
            set: look.set.clone(),
        });
        Some(StoppedBy {
            what,
            batches: merged.batches,
            look,
            relative_half_width: stop.relative_half_width,
            share: stop.share,
            receivers: stop.receivers,
            max_batches: stop.max_batches,
            looks: looks.collect(),
        })
    }

    /// A line that says what ended the run; `confidence` is that of the intervals.
    pub fn line(&self, confidence: f64) -> String {
        match self.look {
            Some(look) => format!("stopped at {} batches (look {look}): {}", self.batches, self.wanted(confidence)),
            None => format!("not stopped by its goal: {} of at most {} batches", self.batches, self.max_batches),
        }
    }

    /// A warning where the limit ended the run.
    pub fn warning(&self, confidence: f64) -> Option<String> {
        if self.what != "limit" {
            return None;
        }
        let at_last = self.looks.last().map_or_else(String::new, |look| {
            let LookSummary { batches, relative_half_width, set } = look;
            if relative_half_width.is_finite() {
                format!(
                    "; at the last look, {batches} batches, {set} stood at {} %",
                    short(100.0 * relative_half_width, 3)
                )
            } else {
                format!("; at the last look, {batches} batches, too many bins of {set} had no information")
            }
        });
        let wanted = self.wanted(confidence);
        Some(format!("the limit of {} batches came before the goal that {wanted}{at_last}", self.max_batches))
    }

    fn wanted(&self, confidence: f64) -> String {
        let sets = if self.receivers.is_empty() { "all receivers".to_owned() } else { self.receivers.join(", ") };
        let bins = if self.share < 1.0 { format!(" in {} of the bins", percent(self.share)) } else { String::new() };
        format!("the {} interval of {sets} is within {}{bins}", percent(confidence), percent(self.relative_half_width))
    }
}
