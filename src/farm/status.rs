//! Checkpoint headers and attempts -> progress: batches done, who is at work where, rates, time left, relative error.
//!
//! Only headers and the short files of attempts are read, so asking is cheap, disturbs no worker, and works from any
//! machine that sees the folder, whoever started the workers. The relative error is an estimate: each shard looks at
//! its own batches, and their median is scaled to all batches done.
//!
//! Headers say which looks of a run with a goal have come, not what was seen there: that is for the one who asks
//! to find out and to fill in ([`Status::judge`]).

mod goal;
mod hosts;
mod view;

pub use goal::{GoalStatus, Seen, Verdict};
pub use hosts::HostStatus;

use super::attempts::{self, Attempt};
use super::checkpoint::{Header, read_compaction, read_header};
use super::folder::Folder;
use super::plan::Plan;
use crate::error::{Error, Result};
use crate::tally::statistics::median;
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::Range;
use std::time::SystemTime;

/// The progress of one shard.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ShardStatus {
    /// Number of the shard.
    pub shard: u64,
    /// Batches done.
    pub batches: u64,
    /// Batches of the shard.
    pub of: u64,
    /// Time spent \[s\].
    pub seconds: f64,
    /// Age of the checkpoint \[s\]; without one, of the last attempt.
    pub age_seconds: u64,
    /// Machine that wrote it; without one, of the last attempt.
    pub host: String,
    /// Worker processes that have begun it.
    pub attempts: u64,
    /// True while it seems to be at work: unfinished, and begun or written not long ago.
    pub active: bool,
    /// Median relative error of this shard alone, an estimate; None when nothing is known.
    pub relative_error_estimate: Option<f64>,
}

/// The progress of a plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Status {
    /// Name of the job.
    pub job: String,
    /// Digest of the plan.
    pub plan: String,
    /// Batches done.
    pub batches: u64,
    /// Batches of the plan.
    pub of: u64,
    /// Number of shards of the plan.
    pub shard_count: u64,
    /// Shards whose checkpoint is complete.
    pub shards_done: u64,
    /// Shards that seem to be at work: unfinished, and begun or written not long ago.
    pub shards_active: u64,
    /// Worker processes that have begun a shard.
    pub attempts: u64,
    /// Batches per second of one worker; None before the first batch.
    pub rate_of_a_worker: Option<f64>,
    /// Time left with as many workers as now \[s\]; None when none is at work.
    pub eta_seconds: Option<f64>,
    /// Median relative error so far, an estimate; None when nothing is known.
    pub relative_error_estimate: Option<f64>,
    /// Where the goal stands; None without one.
    pub goal: Option<GoalStatus>,
    /// Time spent by all workers \[s\].
    pub seconds: f64,
    /// Every machine that has written a checkpoint or begun a shard.
    pub hosts: Vec<HostStatus>,
    /// Every shard with a checkpoint or an attempt.
    pub shards: Vec<ShardStatus>,
    /// Checkpoints that were refused, by name, and why.
    pub refused: Vec<String>,
}

/// The present \[s since 1970\].
pub fn now() -> u64 {
    SystemTime::UNIX_EPOCH.elapsed().map_or(0, |d| d.as_secs())
}

/// The progress of the plan in `folder`.
///
/// # Errors
/// Whatever reading the plan says; checkpoints that are refused are listed in the status instead.
pub fn status(folder: &Folder) -> Result<Status> {
    let plan = folder.read_plan()?;
    let (mut shards, mut refused) = (BTreeMap::new(), Vec::new());
    for (k, path) in folder.checkpoints()? {
        if let Some(header) = kept(read_header(&path, &plan, k), &mut refused)? {
            shards.insert(k, ShardStatus::new(&plan, k, &header));
        }
    }
    // After the shards: what is compacted meanwhile is seen twice, and not missed.
    let folded = kept(read_compaction(folder, &plan), &mut refused)?;
    for (k, header) in (0..).zip(folded.iter().flat_map(|folded| folded.parts(&plan))) {
        shards.insert(k, ShardStatus::new(&plan, k, &header));
    }
    for k in attempts::begun(folder)?.into_iter().filter(|&k| k < plan.shard_count()) {
        let shard = shards.entry(k).or_insert_with(|| ShardStatus::not_begun(&plan, k));
        shard.tried(&plan, &attempts::read(folder, k)?);
    }
    Ok(Status::new(&plan, shards.into_values().collect(), refused))
}

/// The header that was read; None, and why among `refused`, for a file that was refused.
fn kept(read: Result<Option<Header>>, refused: &mut Vec<String>) -> Result<Option<Header>> {
    match read {
        Err(e @ Error::Refused { .. }) => {
            refused.push(e.to_string());
            Ok(None)
        }
        other => other,
    }
}

impl ShardStatus {
    /// Of shard `k`, from the header of its checkpoint.
    pub fn new(plan: &Plan, k: u64, header: &Header) -> Self {
        let range = plan.shard(k);
        let mut shard = ShardStatus {
            shard: k,
            batches: header.batches(),
            of: range.end - range.start,
            seconds: header.seconds(),
            age_seconds: age(header.written),
            host: header.runs.last().map(|run| run.host.clone()).unwrap_or_default(),
            attempts: 0,
            active: false,
            relative_error_estimate: finite(header.relative_error),
        };
        shard.active = shard.is_recent(plan, shard.age_seconds);
        shard
    }

    /// Of shard `k`, without a checkpoint.
    pub fn not_begun(plan: &Plan, k: u64) -> Self {
        let range = plan.shard(k);
        ShardStatus {
            shard: k,
            batches: 0,
            of: range.end - range.start,
            seconds: 0.0,
            age_seconds: 0,
            host: String::new(),
            attempts: 0,
            active: false,
            relative_error_estimate: None,
        }
    }

    /// The range of its batches that are done.
    pub fn done(&self, plan: &Plan) -> Range<u64> {
        let start = plan.shard(self.shard).start;
        start..start + self.batches
    }

    /// Takes the attempts on this shard into account.
    fn tried(&mut self, plan: &Plan, attempts: &[Attempt]) {
        self.attempts = attempts.len() as u64;
        let Some(last) = attempts.iter().max() else { return };
        let since = age(last.started);
        if self.host.is_empty() {
            (self.age_seconds, self.host) = (since, last.host.clone());
        }
        self.active = self.active || self.is_recent(plan, since);
    }

    /// True when it is unfinished, and something of it happened `seconds` ago: not long.
    fn is_recent(&self, plan: &Plan, seconds: u64) -> bool {
        // A batch may be longer than the interval, so twice the interval and some more is "not long ago".
        self.batches < self.of && seconds as f64 <= 2.0 * plan.job.run.checkpoint_seconds + 30.0
    }

    /// Batches per second of its workers; None before the first batch.
    pub fn rate(&self) -> Option<f64> {
        finite(self.batches as f64 / self.seconds).filter(|&r| r > 0.0)
    }
}

impl Status {
    /// From the progress of the shards of `plan`.
    pub fn new(plan: &Plan, shards: Vec<ShardStatus>, refused: Vec<String>) -> Self {
        let run = &plan.job.run;
        let batches: u64 = shards.iter().map(|s| s.batches.min(s.of)).sum();
        let seconds = shards.iter().map(|s| s.seconds).fold(0.0, |a, b| a + b);
        let mut status = Status {
            job: plan.name.clone(),
            plan: plan.digest.clone(),
            batches,
            of: run.batches,
            shard_count: plan.shard_count(),
            shards_done: shards.iter().filter(|s| s.batches >= s.of).count() as u64,
            shards_active: shards.iter().filter(|s| s.active).count() as u64,
            attempts: shards.iter().map(|s| s.attempts).sum(),
            rate_of_a_worker: finite(batches as f64 / seconds).filter(|&r| r > 0.0),
            eta_seconds: None,
            relative_error_estimate: relative_error(&shards, batches),
            goal: GoalStatus::new(plan, &shards),
            seconds,
            hosts: hosts::of(&shards),
            shards,
            refused,
        };
        status.eta_seconds = status.seconds_until(run.batches);
        status
    }

    /// Fills in what was seen at the looks so far: at which one the goal was reached, if at any, and how near the last
    /// one came. `plan` is that of this status.
    pub fn judge(&mut self, plan: &Plan, reached: Option<u64>, seen: Option<Seen>) {
        let Some(goal) = &mut self.goal else { return };
        goal.judge(plan, reached, seen);
        match goal.expected_look {
            // Whatever shards are unfinished, nobody is to finish them.
            _ if reached.is_some() => (self.shards_active, self.eta_seconds) = (0, None),
            Some(look) => {
                let seconds = self.seconds_until(look);
                self.goal.iter_mut().for_each(|goal| goal.eta_seconds = seconds);
            }
            None => {}
        }
    }

    /// True when nothing is left to compute, as far as is known.
    pub fn is_done(&self) -> bool {
        self.batches >= self.of || self.goal.is_some_and(|goal| matches!(goal.verdict, Verdict::ReachedAt(_)))
    }

    /// Time until `batches` are done with as many workers as now \[s\]; None when none is at work.
    fn seconds_until(&self, batches: u64) -> Option<f64> {
        let rate = self.rate_of_a_worker.filter(|_| self.shards_active > 0)?;
        Some(batches.saturating_sub(self.batches) as f64 / (rate * self.shards_active as f64))
    }
}

/// The error of one batch as each shard sees it, its median divided by sqrt(all batches).
fn relative_error(shards: &[ShardStatus], batches: u64) -> Option<f64> {
    let of_a_batch = shards.iter().filter_map(|s| Some(s.relative_error_estimate? * (s.batches as f64).sqrt()));
    finite(median(of_a_batch) / (batches as f64).sqrt())
}

fn finite(x: f64) -> Option<f64> {
    Some(x).filter(|x| x.is_finite())
}

/// Time since `written` \[s\]; 0 where the clock of another machine is ahead.
fn age(written: u64) -> u64 {
    now().saturating_sub(written)
}
