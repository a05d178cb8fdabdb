//! Checkpoints -> one result: a left fold over shards in shard order.
//!
//! Of each shard the longest checkpoint counts, once the batch digests show the others to be its prefixes; so
//! copies count once and the order of the folders changes nothing; plans that ask for other results are refused.
//! Files are read one after the other, a few blocks of bins at a time, so memory holds the result and these blocks,
//! whatever the number of shards. Threads share the blocks of a file; every block is folded in shard order, so their number
//! changes no bit. A file
//! that cannot be trusted stops the merge and is named, with the reason; nothing here writes. Merging knows neither
//! scene nor random numbers.
//!
//! With a goal ([`goal`]) the fold ends at the first look of the plan at which it is reached. A look is judged once
//! every shard before it is complete, and by these shards alone, so the result is a function of the checkpoint
//! files: batches beyond it, by workers that ran ahead, change nothing.

mod choose;
pub mod goal;

use super::checkpoint::{BLOCK, Checksum, Reader, block_count};
use super::folder::Folder;
use super::plan::Plan;
use crate::error::{Error, Result};
use crate::job::{Kept, SetShape};
use crate::tally::statistics::Estimate;
use crate::tally::{FLUX_BINS, MomentBlock, Monitor, Replicates};
use choose::{Candidate, check_length, choose, common_plan};
use goal::{Goal, Look, Stopped};
use rayon::prelude::*;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Blocks read, verified and merged at a time: some 10 MB, so that the threads have enough to share, and memory holds
/// little beside the result.
const AT_ONCE: u32 = 64;

/// The result of one receiver set.
#[derive(Clone, Debug, PartialEq)]
pub enum SetResult {
    /// Moments of batch scores, for maps, and the part that is the same in every batch.
    Moments {
        /// Mean, M2, direct, peak, colour of each bin.
        bins: MomentBlock,
        /// Direct light that is the same in every batch, one entry a bin (NaN: no receiver there, inside a solid
        /// or behind a surface), or empty for zero everywhere.
        fixed_direct: Vec<f64>,
    },
    /// Every batch's score, for grids and points, and the part that is the same in every batch.
    Replicates {
        /// Batch scores of each bin.
        scores: Replicates,
        /// Direct light that is the same in every batch, one entry a bin (NaN: no receiver there, inside a solid
        /// or behind a surface), or empty for zero everywhere.
        fixed_direct: Vec<f64>,
    },
}

/// What all shards together say.
#[derive(Clone, Debug, PartialEq)]
pub struct Merged {
    /// One for each receiver set in job order.
    pub sets: Vec<SetResult>,
    /// For each receiver set its monitored bins, in their order.
    pub monitors: Vec<Vec<Monitor>>,
    /// Flux balance, every batch.
    pub flux: Replicates,
    /// Batches merged.
    pub batches: u64,
    /// Batches of the plan that are missing, as half-open ranges; none when the goal has been reached.
    pub missing: Vec<Range<u64>>,
    /// What ended the run; None when it is unfinished or has no goal.
    pub stopped: Option<Stopped>,
    /// What was seen at every look that could be judged, up to the one at which the goal was reached.
    pub looks: Vec<Look>,
    /// Time spent by all workers on the batches merged \[s\].
    pub seconds: f64,
    /// Instructions with which the kernels of the workers ran, each once.
    pub instructions: Vec<String>,
}

/// Merges the checkpoints in `folders`, all of one plan; with them the plan, the longest when some were extended.
///
/// # Errors
/// [`Error::Refused`] naming every checkpoint that is damaged, foreign or of a newer version, or two that
/// contradict each other; [`Error::Input`] for a folder without a plan; [`Error::Io`].
pub fn merge(folders: &[Folder]) -> Result<(Plan, Merged)> {
    let plan = common_plan(folders)?;
    let chosen = choose(&plan, folders)?;
    if chosen.is_empty() {
        let path = folders.first().map_or(Path::new("."), |f| f.root());
        return Err(Error::refused(path, "holds no checkpoint yet: nothing to merge"));
    }
    let read = (0..plan.sets().len()).collect();
    let merged = fold(&plan, chosen.values(), read)?.result();
    Ok((plan, merged))
}

/// The number of batches after which the goal of the plan in `folders` has been reached; None when it has not yet.
///
/// # Errors
/// As [`merge`].
pub fn goal_reached(folders: &[Folder]) -> Result<Option<u64>> {
    Ok(looks(folders)?.last().filter(|look| look.reached).map(|look| look.batches))
}

/// What is seen at every look of the plan in `folders` that can be judged, up to the one at which the goal is reached; none
/// without a goal. Reads no batch beyond the last of them, and beside headers and flux nothing of the sets that the goal
/// does not ask for.
///
/// # Errors
/// As [`merge`].
pub fn looks(folders: &[Folder]) -> Result<Vec<Look>> {
    let plan = common_plan(folders)?;
    let Some(goal) = Goal::of(&plan) else { return Ok(Vec::new()) };
    let chosen = choose(&plan, folders)?;
    let done = chosen.values().map(|c| (c.header.shard, c.header.batches()));
    let last = plan.last_look(done).unwrap_or(0);
    let before = chosen.values().take_while(|c| plan.shard(c.header.shard).start < last);
    Ok(fold(&plan, before, goal.sets())?.looks)
}

/// Folds the sets numbered in `read` shard after shard, up to the look at which the goal is reached.
fn fold<'a>(plan: &'a Plan, files: impl Iterator<Item = &'a Candidate>, read: Vec<usize>) -> Result<Fold<'a>> {
    let mut fold = Fold::new(plan, read);
    for file in files {
        fold.take(file)?;
        if fold.goal_reached() {
            break;
        }
    }
    Ok(fold)
}

/// The left fold over shards.
struct Fold<'a> {
    plan: &'a Plan,
    shapes: Vec<SetShape>,
    /// Numbers of the sets that are folded; the others stay empty.
    read: Vec<usize>,
    sets: Vec<SetFold>,
    monitors: Vec<Vec<Monitor>>,
    flux: Replicates,
    /// Direct light of the sets that are folded, with the file and the checksums it was taken from.
    fixed: Option<(PathBuf, Vec<Checksum>, Vec<Vec<f64>>)>,
    batches: u64,
    seconds: f64,
    instructions: Vec<String>,
    done: Vec<Range<u64>>,
    goal: Option<Goal>,
    looks: Vec<Look>,
}

/// One receiver set so far: maps as blocks, empty before the first file; others whole.
enum SetFold {
    Moments(Vec<MomentBlock>),
    Replicates(Replicates),
}

impl SetFold {
    /// The random part of a bin over `batches` batches.
    fn estimate(&self, bin: usize, batches: u64) -> Estimate {
        match self {
            SetFold::Moments(blocks) => blocks[bin / BLOCK].estimate(bin % BLOCK, batches),
            SetFold::Replicates(scores) => scores.estimate(bin),
        }
    }
}

impl<'a> Fold<'a> {
    fn new(plan: &'a Plan, read: Vec<usize>) -> Self {
        let shapes = plan.sets();
        let empty = |shape: &SetShape| match shape.kept {
            Kept::Moments { .. } => SetFold::Moments(vec![MomentBlock::default(); block_count(shape) as usize]),
            Kept::EveryBatch => SetFold::Replicates(Replicates::new(shape.bins())),
        };
        let sets = shapes.iter().map(empty).collect();
        let monitors = shapes.iter().map(Monitor::of_set).collect();
        let flux = Replicates::new(FLUX_BINS.len());
        let (done, looks, instructions) = (Vec::new(), Vec::new(), Vec::new());
        let (batches, seconds, fixed) = (0, 0.0, None);
        let goal = Goal::of(plan);
        Fold { plan, shapes, read, sets, monitors, flux, fixed, batches, seconds, instructions, done, goal, looks }
    }

    /// Folds in the next shard.
    fn take(&mut self, file: &Candidate) -> Result<()> {
        let shard = file.header.shard;
        let gone = || Error::refused(&file.path, "changed while it was merged");
        let reader = Reader::open(&file.path, self.plan, shard)?.ok_or_else(gone)?;
        // A worker may have replaced it meanwhile: by a longer one, then.
        if !reader.header().digests.starts_with(&file.header.digests) {
            return Err(gone());
        }
        check_length(self.plan, shard, &file.path, reader.header())?;
        let n = reader.header().batches();
        self.take_fixed(&reader, &file.path)?;
        for &set in &self.read {
            match &mut self.sets[set] {
                SetFold::Moments(blocks) => take_blocks(blocks, &reader, set, (self.batches, n))?,
                SetFold::Replicates(scores) => scores.append(reader.replicates(set)?),
            }
            let next = reader.monitors(set)?;
            self.monitors[set].iter_mut().zip(next).for_each(|(monitor, next)| monitor.append(next));
        }
        self.flux.append(reader.flux()?);
        let start = self.plan.shard(shard).start;
        self.done.push(start..start + n);
        self.batches += n;
        self.seconds += reader.header().seconds;
        if !self.instructions.contains(&reader.header().instructions) {
            self.instructions.push(reader.header().instructions.clone());
        }
        Ok(())
    }

    /// Takes the direct light of the first file, and refuses a file with another.
    fn take_fixed(&mut self, reader: &Reader, path: &Path) -> Result<()> {
        let checksums = reader.fixed_direct_checksums();
        match &self.fixed {
            None => {
                let mut fixed = vec![Vec::new(); self.shapes.len()];
                self.read.iter().try_for_each(|&set| reader.fixed_direct(set).map(|light| fixed[set] = light))?;
                self.fixed = Some((path.to_owned(), checksums, fixed));
                Ok(())
            }
            Some((_, known, _)) if *known == checksums => {
                // The bytes, too, must be those of the checksum.
                self.read.iter().try_for_each(|&set| reader.fixed_direct(set).map(|_| ()))
            }
            Some((first, ..)) => {
                let reason = format!("its direct light is another than in {}", first.display());
                Err(Error::refused(path, reason))
            }
        }
    }

    /// Looks at the goal if a look of the plan comes here; true when it is reached.
    fn goal_reached(&mut self) -> bool {
        let Some(goal) = &self.goal else { return false };
        // With a gap behind it a look cannot be judged, and none after it.
        let whole = self.done.last().is_some_and(|last| last.end == self.batches);
        if !whole || !self.plan.looks().contains(&self.batches) {
            return false;
        }
        let fixed = self.fixed.as_ref().map_or(&[][..], |(.., fixed)| fixed);
        let estimate = |set: usize, bin: usize| self.sets[set].estimate(bin, self.batches).with_fixed(&fixed[set], bin);
        self.looks.push(goal.look(self.batches, estimate));
        self.looks.last().is_some_and(|look| look.reached)
    }

    /// What ended the run so far folded.
    fn stopped(&self) -> Option<Stopped> {
        match self.looks.last() {
            Some(look) if look.reached => Some(Stopped::GoalReached { batches: look.batches }),
            _ if self.goal.is_some() && self.batches == self.plan.job.run.batches => Some(Stopped::Limit),
            _ => None,
        }
    }

    fn result(self) -> Merged {
        let stopped = self.stopped();
        let batches = match stopped {
            Some(Stopped::GoalReached { batches }) => batches,
            Some(Stopped::Limit) | None => self.plan.job.run.batches,
        };
        let missing = missing(batches, &self.done);
        let fixed = self.fixed.map(|(.., fixed)| fixed).unwrap_or_default();
        let sets = self.sets.into_iter().zip(fixed).map(|(set, fixed_direct)| match set {
            SetFold::Moments(blocks) => {
                let mut bins = MomentBlock::default();
                blocks.into_iter().for_each(|block| bins.append(block));
                SetResult::Moments { bins, fixed_direct }
            }
            SetFold::Replicates(scores) => SetResult::Replicates { scores, fixed_direct },
        });
        let (sets, looks, monitors) = (sets.collect(), self.looks, self.monitors);
        let Fold { flux, batches, seconds, instructions, .. } = self;
        Merged { sets, monitors, flux, batches, missing, stopped, looks, seconds, instructions }
    }
}

/// Merges the blocks of one map over `n` = (batches so far, batches of this file), some at a time by all threads, while
/// the disk fetches the next ones.
fn take_blocks(blocks: &mut [MomentBlock], reader: &Reader, set: usize, n: (u64, u64)) -> Result<()> {
    let all = blocks.len() as u32;
    reader.fetch(set, 0..AT_ONCE.min(all));
    for (some, start) in blocks.chunks_mut(AT_ONCE as usize).zip((0..all).step_by(AT_ONCE as usize)) {
        let next = start + some.len() as u32;
        reader.fetch(set, next..(next + AT_ONCE).min(all));
        let take = |(sum, block): (&mut MomentBlock, u32)| {
            let of_file = reader.moments(set, block)?;
            if sum.is_empty() {
                *sum = of_file
            } else {
                sum.merge(n.0, &of_file, n.1)
            }
            Ok(())
        };
        let taken: Vec<Result<()>> = some.par_iter_mut().zip(start..next).map(take).collect();
        // Of several damaged blocks the first is named, whichever thread came upon it first.
        taken.into_iter().collect::<Result<()>>()?;
    }
    Ok(())
}

/// What `done`, in order, leaves of `0..batches`.
fn missing(batches: u64, done: &[Range<u64>]) -> Vec<Range<u64>> {
    let mut gaps = Vec::new();
    let mut next = 0;
    for range in done {
        if range.start > next {
            gaps.push(next..range.start);
        }
        next = range.end.max(next);
    }
    if next < batches {
        gaps.push(next..batches);
    }
    gaps
}

#[cfg(test)]
mod tests;
