//! The left fold itself: files in order, each once through its small sections, and through its maps in passes.
//!
//! ```text
//! for each pass (as many blocks of bins as fit into memory):
//!     for each file, in order:  fold its blocks into those of the pass
//! ```
//!
//! One file is open at a time. Most jobs need one pass; the passes over a larger one keep between them what they have
//! folded in a file without a name. A block sees the same operations in the same order whatever the passes.

use super::blocks::{Blocks, bytes_of};
use super::choose::Candidate;
use super::goal::{Goal, Look, Stopped};
use super::passes::{Part, passes, take_blocks};
use super::rows::Rows;
use super::{Merged, SetResult};
use crate::error::{Error, Result};
use crate::farm::checkpoint::{BLOCK, Checksum, Judged, Reader, Run, part_count};
use crate::farm::plan::Plan;
use crate::job::{Kept, SetShape};
use crate::tally::statistics::Estimate;
use crate::tally::{EveryBatch, FLUX_BINS, MomentBlock, Monitor, Replicates};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Moments folded in one pass, about \[bytes\].
const MEMORY: u64 = 256 << 20;
/// Files of unfinished shards that stay open from pass to pass, so that a worker may go on meanwhile.
const KEPT_OPEN: usize = 64;

/// The left fold over files.
pub(super) struct Fold<'a> {
    plan: &'a Plan,
    scratch: &'a Path,
    shapes: Vec<SetShape>,
    /// Numbers of the sets that are folded; the others stay empty.
    read: Vec<usize>,
    sets: Vec<SetFold>,
    monitors: Vec<Vec<Monitor>>,
    flux: Rows,
    /// Direct light of the sets that are folded, with the file and the checksums it was taken from.
    fixed: Option<(PathBuf, Vec<Checksum>, Vec<Vec<f64>>)>,
    digests: Vec<Checksum>,
    runs: Vec<Run>,
    done: Vec<Range<u64>>,
    goal: Option<Goal>,
    looks: Vec<Look>,
    /// Moments folded in one pass \[bytes\].
    memory: u64,
}

/// One receiver set so far.
enum SetFold {
    Moments(Blocks),
    Replicates(Rows),
}

impl<'a> Fold<'a> {
    /// Nothing yet of the sets numbered in `read`.
    pub fn new(plan: &'a Plan, read: Vec<usize>, scratch: &'a Path) -> Result<Self> {
        Fold::within(plan, read, scratch, MEMORY)
    }

    /// The same with `memory` bytes for a pass, and a sixteenth of them for batch scores.
    pub fn within(plan: &'a Plan, read: Vec<usize>, scratch: &'a Path, memory: u64) -> Result<Self> {
        let shapes = plan.sets();
        let spilled = read.iter().map(|&set| bytes_of(&shapes[set])).sum::<u64>() > memory;
        let rows_spilled = kept_bytes(plan, read.iter().map(|&set| &shapes[set])) > memory / 16;
        let rows = |bins| Rows::new(bins, rows_spilled.then_some(scratch)).map_err(Error::io(scratch));
        let empty = |(set, shape): (usize, &SetShape)| match shape.kept {
            Kept::Moments { .. } => {
                let place = (spilled && read.contains(&set)).then_some(scratch);
                Blocks::new(shape, place).map(SetFold::Moments).map_err(Error::io(scratch))
            }
            Kept::EveryBatch => rows(shape.bins()).map(SetFold::Replicates),
        };
        let sets = shapes.iter().enumerate().map(empty).collect::<Result<_>>()?;
        let monitors = shapes.iter().map(Monitor::of_set).collect();
        let (flux, goal, fixed) = (rows(FLUX_BINS.len())?, Goal::of(plan), None);
        let (digests, runs, done, looks) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let fold =
            Fold { plan, scratch, shapes, read, sets, monitors, flux, fixed, digests, runs, done, goal, looks, memory };
        Ok(fold)
    }

    /// Batches so far.
    pub fn batches(&self) -> u64 {
        self.digests.len() as u64
    }

    /// Folds in the next files, and then looks at the goal if a look of the plan comes there.
    pub fn take(&mut self, files: &[Candidate]) -> Result<()> {
        let before = self.batches();
        let mut kept_open = BTreeMap::new();
        for (number, parts) in passes(&self.shapes, &self.read, self.memory).into_iter().enumerate() {
            let mut blocks = self.take_out(&parts)?;
            let mut so_far = before;
            for (i, file) in files.iter().enumerate() {
                let reader = match kept_open.remove(&i) {
                    Some(reader) => reader,
                    None => file.open(self.plan)?,
                };
                let n = reader.header().batches();
                if number == 0 {
                    self.take_rest(&reader, file)?;
                } else if !self.digests[(so_far as usize)..].starts_with(&reader.header().digests) {
                    return Err(Error::refused(&file.path, "changed while it was merged: merge again"));
                }
                for (part, blocks) in parts.iter().zip(&mut blocks) {
                    take_blocks(blocks, &reader, part, (so_far, n))?;
                }
                so_far += n;
                if n < self.plan.job.run.batches_per_shard && kept_open.len() < KEPT_OPEN {
                    kept_open.insert(i, reader);
                }
            }
            self.put_back(&parts, blocks)?;
        }
        self.look()
    }

    fn take_out(&self, parts: &[Part]) -> Result<Vec<Vec<MomentBlock>>> {
        let of = |part: &Part| part.blocks.clone().map(|i| self.moments(part.set).read(i)).collect();
        parts.iter().map(of).collect::<std::io::Result<_>>().map_err(Error::io(self.scratch))
    }

    fn put_back(&mut self, parts: &[Part], blocks: Vec<Vec<MomentBlock>>) -> Result<()> {
        for (part, blocks) in parts.iter().zip(blocks) {
            let SetFold::Moments(all) = &mut self.sets[part.set] else { unreachable!("parts are of maps") };
            let mut numbered = part.blocks.clone().zip(blocks);
            numbered.try_for_each(|(i, block)| all.write(i, block)).map_err(Error::io(self.scratch))?;
        }
        Ok(())
    }

    /// The map number `set`.
    pub fn moments(&self, set: usize) -> &Blocks {
        match &self.sets[set] {
            SetFold::Moments(blocks) => blocks,
            SetFold::Replicates(_) => unreachable!("the plan says what a set keeps"),
        }
    }

    /// Takes all but the maps.
    fn take_rest(&mut self, reader: &Reader, file: &Candidate) -> Result<()> {
        self.check_looks(reader, file)?;
        self.take_fixed(reader, &file.path)?;
        for &set in &self.read {
            if let SetFold::Replicates(scores) = &mut self.sets[set] {
                take_rows(scores, reader, set, self.scratch)?;
            }
            let next = reader.monitors(set)?;
            self.monitors[set].iter_mut().zip(next).for_each(|(monitor, next)| monitor.append(next));
        }
        take_rows(&mut self.flux, reader, self.shapes.len(), self.scratch)?;
        let start = file.span.start(self.plan);
        self.done.push(start..start + reader.header().batches());
        self.digests.extend(&reader.header().digests);
        self.runs.extend(reader.header().runs.iter().cloned());
        Ok(())
    }

    /// Takes over what was seen at the looks that a compaction has behind it: of the same question, and none of which would have
    /// ended the run.
    fn check_looks(&mut self, reader: &Reader, file: &Candidate) -> Result<()> {
        let Some(goal) = self.goal.as_ref().filter(|_| !reader.header().looks.is_empty() || file.span.shards() > 0)
        else {
            return Ok(());
        };
        let end = reader.header().batches();
        for batches in self.plan.looks().into_iter().filter(|&look| look < end) {
            let same = |seen: &&Judged| seen.batches == batches && seen.question == goal.question();
            let Some(seen) = reader.header().looks.iter().find(same) else {
                let reason =
                    format!("compacted beyond the look at {batches} batches, under another [stop] or confidence");
                return Err(Error::refused(&file.path, reason));
            };
            let look = goal.judge(batches, seen.relative_half_width, seen.set as usize);
            if look.reached {
                let reason = format!("the goal is reached at {batches} batches, inside what has been compacted");
                return Err(Error::refused(&file.path, reason));
            }
            self.looks.push(look);
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

    /// Looks at the goal if a look of the plan comes here.
    fn look(&mut self) -> Result<()> {
        let Some(goal) = &self.goal else { return Ok(()) };
        let whole = self.done.last().is_some_and(|last| last.end == self.batches());
        if whole && self.plan.looks().contains(&self.batches()) {
            let look = goal.look(self.batches(), &|set, take| self.estimates(set, take))?;
            self.looks.push(look);
        }
        Ok(())
    }

    /// The estimate of every bin of a set that has a receiver, in order.
    fn estimates(&self, set: usize, take: &mut dyn FnMut(Estimate)) -> Result<()> {
        let fixed = &self.fixed_direct()[set];
        let batches = self.batches();
        match &self.sets[set] {
            SetFold::Replicates(scores) => {
                let of_group = |first: usize, group: &Replicates| {
                    let estimate = |bin| group.estimate(bin).with_fixed(fixed, first + bin);
                    (0..group.bins as usize).filter_map(estimate).for_each(&mut *take);
                };
                scores.each(&mut { of_group }).map_err(Error::io(self.scratch))?;
            }
            SetFold::Moments(blocks) => {
                for i in 0..blocks.count() {
                    let block = blocks.read(i).map_err(Error::io(self.scratch))?;
                    let estimate = |bin| block.estimate(bin, batches).with_fixed(fixed, i * BLOCK + bin);
                    (0..block.len()).filter_map(estimate).for_each(&mut *take);
                }
            }
        }
        Ok(())
    }

    /// True when the last look found the goal reached.
    pub fn reached(&self) -> bool {
        self.looks.last().is_some_and(|look| look.reached)
    }

    /// What ended the run so far folded.
    pub fn stopped(&self) -> Option<Stopped> {
        match self.looks.last() {
            Some(look) if look.reached => Some(Stopped::GoalReached { batches: look.batches }),
            _ if self.goal.is_some() && self.batches() == self.plan.job.run.batches => Some(Stopped::Limit),
            _ => None,
        }
    }

    /// Direct light of each set, empty of those that are not read.
    pub fn fixed_direct(&self) -> &[Vec<f64>] {
        self.fixed.as_ref().map_or(&[][..], |(.., fixed)| fixed)
    }

    /// Batch scores of the set number `set`, or of the flux balance after the last one.
    pub fn rows(&self, set: usize) -> &Rows {
        match self.sets.get(set) {
            Some(SetFold::Replicates(scores)) => scores,
            Some(SetFold::Moments(_)) => unreachable!("the plan says what a set keeps"),
            None => &self.flux,
        }
    }

    /// Monitored bins of each set.
    pub fn monitors(&self) -> &[Vec<Monitor>] {
        &self.monitors
    }

    /// Digests of all batches.
    pub fn digests(&self) -> &[Checksum] {
        &self.digests
    }

    /// Who computed them.
    pub fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// What was seen at the looks so far, as a file keeps it.
    pub fn judged(&self) -> Vec<Judged> {
        let Some(goal) = &self.goal else { return Vec::new() };
        let question = goal.question();
        let kept = |look: &Look| Judged {
            question,
            batches: look.batches,
            relative_half_width: look.relative_half_width,
            set: goal.number_of(&look.set) as u32,
        };
        self.looks.iter().map(kept).collect()
    }

    /// What all files together say.
    pub fn result(self) -> Merged {
        let (stopped, batches) = (self.stopped(), self.batches());
        let wanted = match stopped {
            Some(Stopped::GoalReached { batches }) => batches,
            Some(Stopped::Limit) | None => self.plan.job.run.batches,
        };
        let missing = missing(wanted, &self.done);
        let fixed = self.fixed.map(|(.., fixed)| fixed).unwrap_or_default();
        let sets = self.sets.into_iter().zip(fixed).map(|(set, fixed_direct)| match set {
            SetFold::Moments(bins) => SetResult::Moments { bins, fixed_direct },
            SetFold::Replicates(scores) => SetResult::Replicates { scores, fixed_direct },
        });
        let (sets, looks, monitors, flux) = (sets.collect(), self.looks, self.monitors, self.flux);
        // One after the other, so that it is the same whatever was compacted.
        let seconds = self.runs.iter().fold(0.0, |sum, run| sum + run.seconds);
        let mut instructions: Vec<String> = Vec::new();
        for run in self.runs {
            if !instructions.contains(&run.instructions) {
                instructions.push(run.instructions);
            }
        }
        Merged { sets, monitors, flux, batches, missing, stopped, looks, seconds, instructions }
    }
}

/// Bytes of the batch scores of `shapes` and of the flux balance.
fn kept_bytes<'a>(plan: &Plan, shapes: impl Iterator<Item = &'a SetShape>) -> u64 {
    let kept = shapes.filter(|shape| shape.kept == Kept::EveryBatch).map(|shape| shape.bins() as u64);
    (kept.sum::<u64>() + FLUX_BINS.len() as u64).saturating_mul(16 * plan.job.run.batches)
}

/// Takes the batch scores of the set number `set` out of a file, part by part.
fn take_rows(rows: &mut Rows, reader: &Reader, set: usize, scratch: &Path) -> Result<()> {
    rows.append(reader.extremes(set)?);
    for part in 0..part_count(rows.bins(), reader.header().batches()) {
        rows.extend(reader.scores(set, part)?).map_err(Error::io(scratch))?;
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
