//! Starts worker processes, one for each shard, watches their checkpoint headers, restarts what fails.
//!
//! It knows files and processes only: no tally, no photometry. Everything a worker has done lives in its
//! checkpoint, so a worker, this process or the machine may die at any instant and the next run goes on from there.
//! Whether a goal has been reached is decided by somebody else, from the same files; this module knows when to ask.

mod look;
mod machine;
mod process;
mod progress;

pub use machine::workers_that_fit;

use super::checkpoint::{Header, read_compaction, read_header, read_progress};
use super::folder::Folder;
use super::plan::Plan;
use super::status::ShardStatus;
use crate::error::{Error, Result};
use look::Watch;
use process::{Exit, Worker};
use progress::Progress;
use signal_hook::consts::{SIGINT, SIGTERM};
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// A shard may fail this often in a row without a new batch.
const FAILURES: u32 = 3;
/// Time between two looks at the workers.
const POLL: Duration = Duration::from_millis(50);

/// How `run` was asked to work.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Worker processes; None for as many as there are cores and memory for.
    pub workers: Option<usize>,
    /// No progress.
    pub quiet: bool,
}

/// How a run ended when nothing failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// Every batch had been done, or the goal been reached, before: nothing was started.
    WasDone,
    /// Every batch of the plan is in a checkpoint, or enough of them that the goal is reached.
    Done,
    /// A signal asked to stop; what was done is in the checkpoints.
    Stopped,
}

/// Says whether the plan in a folder has reached its goal: a function of the checkpoints there.
pub type GoalReached<'a> = &'a dyn Fn(&Folder) -> Result<bool>;
/// Is told whenever a worker has finished its shard.
pub type ShardDone<'a> = &'a dyn Fn(&Folder);

/// Computes all that is unfinished of `plan` in `folder`; where the plan has a goal, until `goal_reached` says so of the
/// folder.
///
/// # Errors
/// [`Error::Refused`] for a checkpoint that is damaged or foreign, and what a worker refuses;
/// [`Error::Failed`] for a shard that fails three times without progress; those of `goal_reached`.
pub fn run(
    folder: &Folder,
    plan: &Plan,
    options: Options,
    goal_reached: GoalReached,
    shard_done: ShardDone,
) -> Result<Ended> {
    let shards = read_shards(folder, plan)?;
    let waiting: VecDeque<u64> = shards.iter().filter(|s| s.batches < s.of).map(|s| s.shard).collect();
    let mut watch = Watch::new(folder, plan, goal_reached);
    if waiting.is_empty() || watch.goal_reached(&shards)? {
        return Ok(Ended::WasDone);
    }
    machine::check_memory(plan)?;
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGTERM, SIGINT] {
        signal_hook::flag::register(signal, Arc::clone(&stop))
            .map_err(|e| Error::Failed(format!("cannot catch signal {signal}: {e}")))?;
    }
    let slots = workers_that_fit(plan, options.workers).min(waiting.len());
    let failures = vec![0; shards.len()];
    let mut progress = Progress::new(plan, &shards, options.quiet);
    let mut crew = Crew { folder, plan, slots, waiting, running: Vec::new(), shards, failures, shard_done };
    let ended = crew.work(&stop, &mut watch, &mut progress);
    // Whatever happened, nobody is left behind and every checkpoint is written.
    let dismissed = crew.dismiss();
    progress.finish(&crew.shards);
    first_failure(ended, dismissed)
}

/// How the run ended; what went wrong at work comes before what went wrong at the end of it.
fn first_failure(ended: Result<Ended>, dismissed: Result<()>) -> Result<Ended> {
    ended.and_then(|ended| dismissed.map(|()| ended))
}

/// The progress of every shard, from headers.
fn read_shards(folder: &Folder, plan: &Plan) -> Result<Vec<ShardStatus>> {
    let folded = read_compaction(folder, plan)?.map_or_else(Vec::new, |folded| folded.parts(plan));
    let of = |k| Ok(shard_status(plan, k, read_progress(folder, plan, &folded, k)?));
    (0..plan.shard_count()).map(of).collect()
}

fn read_shard(folder: &Folder, plan: &Plan, k: u64) -> Result<ShardStatus> {
    let header = match read_header(&folder.shard_path(k), plan, k)? {
        // Somebody may have compacted it meanwhile.
        None => read_compaction(folder, plan)?.and_then(|folded| folded.parts(plan).into_iter().nth(k as usize)),
        found => found,
    };
    Ok(shard_status(plan, k, header))
}

fn shard_status(plan: &Plan, k: u64, header: Option<Header>) -> ShardStatus {
    header.map_or_else(|| ShardStatus::not_begun(plan, k), |header| ShardStatus::new(plan, k, &header))
}

/// The workers and what is left to do.
struct Crew<'a> {
    folder: &'a Folder,
    plan: &'a Plan,
    /// Workers at a time.
    slots: usize,
    waiting: VecDeque<u64>,
    running: Vec<Worker>,
    /// Of every shard, as its checkpoint said last.
    shards: Vec<ShardStatus>,
    /// Of every shard, failures in a row without a new batch.
    failures: Vec<u32>,
    shard_done: ShardDone<'a>,
}

impl Crew<'_> {
    /// Until all is done, the goal is reached, a signal asks to stop, or something fails.
    fn work(&mut self, stop: &AtomicBool, watch: &mut Watch, progress: &mut Progress) -> Result<Ended> {
        while !(self.waiting.is_empty() && self.running.is_empty()) {
            if stop.load(Ordering::Relaxed) {
                return Ok(Ended::Stopped);
            }
            self.fill_slots()?;
            std::thread::sleep(POLL);
            self.collect()?;
            if watch.goal_reached(&self.shards)? {
                return Ok(Ended::Done);
            }
            if progress.due() {
                self.refresh()?;
                progress.show(&self.shards);
            }
        }
        Ok(Ended::Done)
    }

    fn fill_slots(&mut self) -> Result<()> {
        while self.running.len() < self.slots {
            let Some(shard) = self.waiting.pop_front() else { break };
            let at_work = (self.running.len() + 1 + self.waiting.len()).min(self.slots);
            let threads = (machine::cores() / at_work).max(1);
            self.running.push(Worker::start(self.folder, shard, threads, self.shards[shard as usize].batches)?);
        }
        Ok(())
    }

    /// Takes in the workers that have ended.
    fn collect(&mut self) -> Result<()> {
        let mut i = 0;
        while i < self.running.len() {
            match self.running[i].ended()? {
                None => i += 1,
                Some(exit) => {
                    let worker = self.running.remove(i);
                    self.take_in(worker, exit)?;
                }
            }
        }
        Ok(())
    }

    fn take_in(&mut self, mut worker: Worker, exit: Exit) -> Result<()> {
        let shard = worker.shard;
        if exit == Exit::Refused {
            return Err(Error::Worker { shard, message: worker.last_words(), code: 2 });
        }
        let now = read_shard(self.folder, self.plan, shard)?;
        let advanced = now.batches > worker.batches_at_start;
        let done = now.batches >= now.of;
        self.shards[shard as usize] = now;
        if done {
            (self.shard_done)(self.folder);
            return Ok(());
        }
        let failures = &mut self.failures[shard as usize];
        *failures = if advanced { 0 } else { *failures + 1 };
        if *failures < FAILURES {
            self.waiting.push_front(shard);
            return Ok(());
        }
        let message = format!("{exit} three times without progress\n{}", worker.last_words());
        Err(Error::Worker { shard, message, code: 1 })
    }

    /// Reads the headers of the shards at work.
    fn refresh(&mut self) -> Result<()> {
        for worker in &self.running {
            self.shards[worker.shard as usize] = read_shard(self.folder, self.plan, worker.shard)?;
        }
        Ok(())
    }

    /// Asks every worker to write its checkpoint and stop, and waits until all have; then says what failed first.
    fn dismiss(&mut self) -> Result<()> {
        self.running.iter().for_each(Worker::ask_to_stop);
        let waited: Vec<Result<()>> = self.running.iter_mut().map(Worker::wait).collect();
        // A checkpoint refused here has been or will be refused by name; the last look is for the progress only.
        let _ = self.refresh();
        waited.into_iter().collect()
    }
}

#[cfg(test)]
mod tests;
