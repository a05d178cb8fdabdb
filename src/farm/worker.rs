//! One shard, from where its checkpoint left it: batch after batch into the tally, checkpoints in between.
//!
//! The only place that makes a thread pool, and that has a clock that decides when to write. A worker knows neither other
//! workers nor the final map; two workers on one shard by mistake compute the same batches and do no harm.

mod signals;

use super::attempts::{self, Attempt};
use super::checkpoint::{self, Reader, Run, Snapshot, read_compaction};
use super::durable;
use super::folder::Folder;
use super::inputs;
use super::plan::Plan;
use super::realization::Realization;
use super::status::now;
use crate::error::{Error, Result};
use crate::geometry::simd::Path as Instructions;
use crate::tally::statistics::{Estimate, median};
use crate::tally::{SetTally, Tally};
use nix::sys::prctl;
use nix::sys::signal::Signal;
use nix::unistd::{Pid, getppid};
use signals::Signals;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Bins of a set that the estimate of the error so far looks at, at most.
const SAMPLED_BINS: usize = 4096;
/// The first checkpoint comes early, so that progress shows.
const FIRST_CHECKPOINT: Duration = Duration::from_secs(1);

/// What `work` was asked to do.
#[derive(Clone, Debug)]
pub struct Order {
    /// The folder of the plan.
    pub folder: Folder,
    /// Number of the shard.
    pub shard: u64,
    /// Threads; None for as many as there are cores.
    pub threads: Option<usize>,
    /// Process whose end ends this one: the coordinator that started it.
    pub parent: Option<i32>,
}

/// How a worker ended when nothing failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// Every batch of the shard is in the checkpoint.
    Done,
    /// A signal asked to stop; the batches so far are in the checkpoint.
    Stopped,
    /// SIGUSR2 said that time is nearly up; the batches so far are in the checkpoint.
    TimeUp {
        /// Batches that this process has added.
        added: u64,
    },
}

/// A worker that is about to compute its first batch.
#[derive(Clone, Debug)]
pub struct Begun {
    /// Number of the shard.
    pub shard: u64,
    /// Batches of the shard.
    pub of: u64,
    /// Number of this attempt, from 1.
    pub number: u64,
    /// What is remembered of it.
    pub attempt: Attempt,
}

impl std::fmt::Display for Begun {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Begun { shard, of, number, attempt: Attempt { host, batches, process, .. } } = self;
        write!(f, "shard {shard}: attempt {number} on {host}, process {process}, goes on from batch {batches} of {of}")
    }
}

/// Waits for the plan of `order`, one with its shard, `seconds` at most: what another machine has written or extended a network file
/// system may show late. Says nothing of what it sees: [`work`] does.
pub fn await_plan(order: &Order, seconds: u64) {
    let (begun, patience) = (Instant::now(), Duration::from_secs(seconds));
    let is_there = || order.folder.read_plan().is_ok_and(|plan| order.shard < plan.shard_count());
    while begun.elapsed() < patience && !is_there() {
        std::thread::sleep(Duration::from_secs(1).min(patience));
    }
}

/// Computes the rest of one shard; `begun` is told before the first batch.
///
/// # Errors
/// [`Error::Input`] for a shard that the plan has not; [`Error::Refused`] for a checkpoint that is not this shard's
/// (it is left as it is); [`Error::Io`].
pub fn work(order: &Order, begun: &(dyn Fn(&Begun) + Sync)) -> Result<Ended> {
    durable::arm_fault()?;
    let signals = Signals::catch()?;
    if let Some(parent) = order.parent {
        die_with(parent, &signals)?;
    }
    let plan = order.folder.read_plan()?;
    if order.shard >= plan.shard_count() {
        let allowed = format!("0 .. {}", plan.shard_count() - 1);
        return Err(Error::input("command line", "--shard", order.shard, allowed));
    }
    let folded = read_compaction(&order.folder, &plan)?;
    if folded.is_some_and(|folded| !folded.digests_of(&plan, order.shard).is_empty()) {
        return Ok(Ended::Done);
    }
    let work = Work::resume(&order.folder, &plan, order.shard)?;
    if work.missing() == 0 {
        return Ok(Ended::Done);
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(order.threads.unwrap_or(0)).build();
    let pool = pool.map_err(|e| Error::Failed(format!("cannot start threads: {e}")))?;
    pool.install(|| work.finish(&order.folder, &signals, begun))
}

/// Asks the kernel for SIGTERM when `parent` ends, however it ends: no worker outlives its coordinator for long.
fn die_with(parent: i32, signals: &Signals) -> Result<()> {
    prctl::set_pdeathsig(Signal::SIGTERM).map_err(|e| Error::Failed(format!("prctl: {e}")))?;
    if getppid() != Pid::from_raw(parent) {
        // It ended before the kernel knew our wish.
        signals.stop();
    }
    Ok(())
}

/// The state of a shard in memory.
struct Work<'a> {
    plan: &'a Plan,
    shard: u64,
    path: PathBuf,
    tally: Tally,
    /// Direct light as the checkpoint has it; None without a checkpoint.
    fixed_direct: Option<Vec<Vec<f64>>>,
    /// Who computed what the checkpoint had when this process began.
    before: Vec<Run>,
    /// Batches in the checkpoint on disk.
    saved: u64,
}

impl<'a> Work<'a> {
    /// From the checkpoint, or from nothing.
    fn resume(folder: &Folder, plan: &'a Plan, shard: u64) -> Result<Self> {
        let path = folder.shard_path(shard);
        let mut work = Work {
            plan,
            shard,
            path,
            tally: Tally::new(&plan.sets()),
            fixed_direct: None,
            before: Vec::new(),
            saved: 0,
        };
        if let Some(reader) = Reader::open(&work.path, plan, shard)? {
            work.tally = reader.tally()?;
            let fixed = (0..plan.sets().len()).map(|set| reader.fixed_direct(set)).collect::<Result<_>>()?;
            work.fixed_direct = Some(fixed);
            work.before = reader.header().runs.clone();
            work.saved = work.tally.batches();
        }
        Ok(work)
    }

    /// Number of batches still to do.
    fn missing(&self) -> u64 {
        let range = self.plan.shard(self.shard);
        (range.end - range.start).saturating_sub(self.tally.batches())
    }

    fn finish(mut self, folder: &Folder, signals: &Signals, begun: &dyn Fn(&Begun)) -> Result<Ended> {
        let scene = inputs::load_scene(folder, self.plan)?;
        let realization = Realization::new(&self.plan.job, &scene, &self.plan.bounds);
        let fixed = realization.fixed_direct();
        self.check_fixed_direct(fixed)?;
        let started = Instant::now();
        let mut schedule = Schedule::new(self.plan.job.run.checkpoint_seconds);
        let range = self.plan.shard(self.shard);
        let before = self.tally.batches();
        begun(&self.begin(folder, range.end - range.start)?);
        while self.missing() > 0 && !signals.asks_to_end() {
            self.tally.accumulate(&realization.batch(range.start + self.tally.batches()));
            let due = signals.asks_to_save() || schedule.due(started.elapsed());
            if due && self.missing() > 0 {
                self.save(fixed, started.elapsed())?;
                schedule.written(started.elapsed());
            }
        }
        if self.tally.batches() > self.saved {
            self.save(fixed, started.elapsed())?;
        }
        Ok(match (self.missing(), signals.time_up()) {
            (0, _) => Ended::Done,
            (_, true) => Ended::TimeUp { added: self.tally.batches() - before },
            (_, false) => Ended::Stopped,
        })
    }

    /// Remembers this attempt.
    fn begin(&self, folder: &Folder, of: u64) -> Result<Begun> {
        let (started, host) = (now(), host_name());
        let attempt = Attempt { started, host, process: std::process::id(), batches: self.tally.batches() };
        let number = attempts::add(folder, self.shard, &attempt)?;
        Ok(Begun { shard: self.shard, of, number, attempt })
    }

    /// Direct light computed here must be that of the checkpoint, bit for bit: it is stored once and added once.
    fn check_fixed_direct(&self, here: &[Vec<f64>]) -> Result<()> {
        let bits = |sets: &[Vec<f64>]| -> Vec<Vec<u64>> {
            sets.iter().map(|set| set.iter().map(|x| x.to_bits()).collect()).collect()
        };
        match &self.fixed_direct {
            Some(there) if bits(there) != bits(here) => {
                Err(Error::refused(&self.path, "its direct light is not the one computed here"))
            }
            _ => Ok(()),
        }
    }

    fn save(&mut self, fixed_direct: &[Vec<f64>], elapsed: Duration) -> Result<()> {
        // Many a tool that copies a planned folder leaves out what is empty.
        durable::make_inside(self.path.parent().expect("a checkpoint lies in a folder"))?;
        let before: u64 = self.before.iter().map(|run| run.batches).sum();
        let here = Run {
            batches: self.tally.batches() - before,
            host: host_name(),
            instructions: Instructions::chosen()?.name().to_owned(),
            seconds: elapsed.as_secs_f64(),
        };
        let snapshot = Snapshot {
            plan: self.plan,
            shard: self.shard,
            tally: &self.tally,
            fixed_direct,
            runs: &Run::after(&self.before, here),
            written: now(),
            relative_error: relative_error(&self.tally, fixed_direct),
        };
        checkpoint::write(Path::new(&self.path), &snapshot)?;
        self.saved = self.tally.batches();
        Ok(())
    }
}

/// When to write: after a second, then at intervals doubling up to the one of the job.
struct Schedule {
    interval: Duration,
    longest: Duration,
    next: Duration,
}

impl Schedule {
    fn new(longest_seconds: f64) -> Self {
        let longest = Duration::from_secs_f64(longest_seconds);
        let interval = FIRST_CHECKPOINT.min(longest);
        Schedule { interval, longest, next: interval }
    }

    fn due(&self, elapsed: Duration) -> bool {
        elapsed >= self.next
    }

    fn written(&mut self, elapsed: Duration) {
        self.interval = (2 * self.interval).min(self.longest);
        self.next = elapsed + self.interval;
    }
}

fn host_name() -> String {
    nix::unistd::gethostname().map_or_else(|_| "unknown".to_owned(), |name| name.to_string_lossy().into_owned())
}

/// Median over the receiver sets of the median relative error of their bins so far; at most [`SAMPLED_BINS`] evenly
/// spaced bins of a set are looked at. An estimate for progress, never for a result.
fn relative_error(tally: &Tally, fixed_direct: &[Vec<f64>]) -> f64 {
    let of_set = |(set, fixed): (&SetTally, &Vec<f64>)| {
        let bins = match set {
            SetTally::Moments(m) => m.bins.len(),
            SetTally::Replicates(r) => r.bins as usize,
        };
        let error = |bin: usize| {
            let estimate = match set {
                SetTally::Moments(m) => m.bins.estimate(bin, m.n),
                SetTally::Replicates(r) => r.estimate(bin),
            };
            estimate.with_fixed(fixed, bin).map_or(f64::NAN, Estimate::relative_error)
        };
        median((0..bins).step_by(bins.div_ceil(SAMPLED_BINS).max(1)).map(error))
    };
    median(tally.sets.iter().zip(fixed_direct).map(of_set))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checkpoints_come_early_then_at_doubling_intervals() {
        let mut schedule = Schedule::new(3.0);
        let mut times = Vec::new();
        for tenth in 0..150 {
            let now = Duration::from_millis(100 * tenth);
            if schedule.due(now) {
                schedule.written(now);
                times.push(tenth);
            }
        }
        assert_eq!(times, [10, 30, 60, 90, 120]);
        assert!(Schedule::new(0.1).due(Duration::from_millis(100)));
    }
}
