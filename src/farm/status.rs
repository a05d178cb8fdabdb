//! Checkpoint headers -> progress: batches done, rate, age, time left, relative error so far.
//!
//! Only headers are read, so asking is cheap and never disturbs a worker. The relative error is an estimate: each
//! shard looks at its own batches, and their median is scaled to all batches done.
//!
//! Headers say which looks of a run with a goal have come, not what was seen there: that is for the one who asks
//! to find out and to fill in ([`Status::judge`]).

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
    /// Age of the checkpoint \[s\].
    pub age_seconds: u64,
    /// Machine that wrote it.
    pub host: String,
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
    /// Shards that seem to be at work: unfinished, and written not long ago.
    pub shards_active: u64,
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
    /// Every shard with a checkpoint.
    pub shards: Vec<ShardStatus>,
    /// Checkpoints that were refused, by name, and why.
    pub refused: Vec<String>,
}

/// How far a run with a goal is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct GoalStatus {
    /// The last look before which every batch is done; None before the first.
    pub last_look: Option<u64>,
    /// The look after that; None when the limit comes first.
    pub next_look: Option<u64>,
    /// What is known of the looks so far.
    pub verdict: Verdict,
}

/// What is known of the looks of a run so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Nobody has looked: it would take reading tallies.
    Open,
    /// The goal was reached at no look so far.
    NotReached,
    /// The goal was reached after this number of batches: the run is done.
    ReachedAt(u64),
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
    let folded = kept(read_compaction(folder, &plan), &mut refused)?;
    for (k, header) in (0..).zip(folded.iter().flat_map(|folded| folded.parts(&plan))) {
        shards.insert(k, ShardStatus::new(&plan, k, &header));
    }
    for (k, path) in folder.checkpoints()? {
        if let Some(header) = kept(read_header(&path, &plan, k), &mut refused)? {
            shards.entry(k).or_insert_with(|| ShardStatus::new(&plan, k, &header));
        }
    }
    let shards = shards.into_values().collect();
    Ok(Status::new(&plan, shards, refused))
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
        ShardStatus {
            shard: k,
            batches: header.batches(),
            of: range.end - range.start,
            seconds: header.seconds(),
            age_seconds: now().saturating_sub(header.written),
            host: header.runs.last().map(|run| run.host.clone()).unwrap_or_default(),
            relative_error_estimate: finite(header.relative_error),
        }
    }

    /// Of shard `k`, without a checkpoint.
    pub fn not_begun(plan: &Plan, k: u64) -> Self {
        let range = plan.shard(k);
        let (of, host) = (range.end - range.start, String::new());
        ShardStatus { shard: k, batches: 0, of, seconds: 0.0, age_seconds: 0, host, relative_error_estimate: None }
    }

    /// The range of its batches that are done.
    pub fn done(&self, plan: &Plan) -> Range<u64> {
        let start = plan.shard(self.shard).start;
        start..start + self.batches
    }

    fn active(&self, checkpoint_seconds: f64) -> bool {
        // A batch may be longer than the interval, so twice the interval and some more is "not long ago".
        self.batches < self.of && self.age_seconds as f64 <= 2.0 * checkpoint_seconds + 30.0
    }
}

impl Status {
    /// From the progress of the shards of `plan`.
    pub fn new(plan: &Plan, shards: Vec<ShardStatus>, refused: Vec<String>) -> Self {
        let run = &plan.job.run;
        let batches: u64 = shards.iter().map(|s| s.batches.min(s.of)).sum();
        let seconds = shards.iter().map(|s| s.seconds).fold(0.0, |a, b| a + b);
        let shards_active = shards.iter().filter(|s| s.active(run.checkpoint_seconds)).count() as u64;
        let rate = finite(batches as f64 / seconds).filter(|&r| r > 0.0);
        let left = (run.batches - batches) as f64;
        let eta = rate.filter(|_| shards_active > 0).map(|r| left / (r * shards_active as f64));
        Status {
            job: plan.name.clone(),
            plan: plan.digest.clone(),
            batches,
            of: run.batches,
            shard_count: plan.shard_count(),
            shards_done: shards.iter().filter(|s| s.batches >= s.of).count() as u64,
            shards_active,
            rate_of_a_worker: rate,
            eta_seconds: eta,
            relative_error_estimate: relative_error(&shards, batches),
            goal: GoalStatus::new(plan, &shards),
            seconds,
            shards,
            refused,
        }
    }

    /// Fills in what was seen at the looks so far: at which one the goal was reached, if at any.
    pub fn judge(&mut self, reached: Option<u64>) {
        let Some(goal) = &mut self.goal else { return };
        goal.verdict = reached.map_or(Verdict::NotReached, Verdict::ReachedAt);
        if reached.is_some() {
            // Whatever shards are unfinished, nobody is to finish them.
            (self.shards_active, self.eta_seconds) = (0, None);
        }
    }
}

impl GoalStatus {
    /// From the progress of the shards of `plan`, in shard order; None without a goal.
    fn new(plan: &Plan, shards: &[ShardStatus]) -> Option<Self> {
        plan.job.stop.as_ref()?;
        let last_look = plan.last_look(shards.iter().map(|s| s.done(plan)));
        let next_look = plan.looks().into_iter().find(|&look| Some(look) > last_look);
        let verdict = if last_look.is_some() { Verdict::Open } else { Verdict::NotReached };
        Some(GoalStatus { last_look, next_look, verdict })
    }
}

impl std::fmt::Display for GoalStatus {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match (self.verdict, self.last_look) {
            (Verdict::ReachedAt(batches), _) => return write!(f, "goal reached at {batches} batches: done"),
            (Verdict::Open, Some(look)) => write!(f, "look at {look} batches: `lampyris merge` says what it shows, ")?,
            (Verdict::NotReached, Some(look)) => write!(f, "goal not reached at {look} batches, ")?,
            (_, None) => {}
        }
        match self.next_look {
            Some(look) => write!(f, "next look at {look} batches"),
            None => write!(f, "no look left before the limit"),
        }
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

impl std::fmt::Display for Status {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        writeln!(
            f,
            "{}: {} of {} batches, {} of {} shards done",
            self.job, self.batches, self.of, self.shards_done, self.shard_count
        )?;
        if let Some(rate) = self.rate_of_a_worker {
            writeln!(f, "{rate:.3} batches/s per worker, {} at work, {:.1} s spent", self.shards_active, self.seconds)?;
        }
        if let Some(eta) = self.eta_seconds {
            let about = if self.goal.is_some() { "at most about" } else { "about" };
            writeln!(f, "{about} {eta:.0} s left")?;
        }
        if let Some(error) = self.relative_error_estimate {
            writeln!(f, "median relative error so far: {:.3} % (an estimate)", 100.0 * error)?;
        }
        if let Some(goal) = &self.goal {
            writeln!(f, "{goal}")?;
        }
        if self.goal.is_some_and(|goal| matches!(goal.verdict, Verdict::ReachedAt(_))) {
            return self.refused.iter().try_for_each(|line| writeln!(f, "{line}"));
        }
        for s in self.shards.iter().filter(|s| s.batches < s.of) {
            writeln!(
                f,
                "shard {}: {} of {} batches, written {} s ago on {}",
                s.shard, s.batches, s.of, s.age_seconds, s.host
            )?;
        }
        self.refused.iter().try_for_each(|line| writeln!(f, "{line}"))
    }
}
