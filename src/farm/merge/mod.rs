//! Checkpoints -> one result: a left fold over shards in shard order.
//!
//! Of each shard the longest checkpoint counts, once the batch digests show the others to be its prefixes; so
//! copies count once and the order of the folders changes nothing. Files are read one after the other, a block of
//! bins at a time, so memory holds the result and one block. A file that cannot be trusted stops the merge and is
//! named, with the reason; nothing here writes. Merging knows neither scene nor random numbers.

use super::checkpoint::{Checksum, Header, Reader, block_count, read_header};
use super::folder::Folder;
use super::plan::Plan;
use crate::error::{Error, Result};
use crate::job::{Kept, SetShape};
use crate::tally::{FLUX_BINS, MomentBlock, Monitor, Replicates};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

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
    /// Batches of the plan that are missing, as half-open ranges.
    pub missing: Vec<Range<u64>>,
    /// Time spent by all workers \[s\].
    pub seconds: f64,
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
    let mut fold = Fold::new(&plan);
    for file in chosen.values() {
        fold.take(file)?;
    }
    let merged = fold.result();
    Ok((plan, merged))
}

/// The plan of all folders; the one with the most batches where they differ in that.
fn common_plan(folders: &[Folder]) -> Result<Plan> {
    let mut common: Option<Plan> = None;
    for folder in folders {
        let plan = folder.read_plan()?;
        let Some(first) = &common else {
            common = Some(plan);
            continue;
        };
        let differences = plan.differences(first);
        if !differences.is_empty() {
            let reason = format!("another plan than that of the first folder:\n  {}", differences.join("\n  "));
            return Err(Error::refused(&folder.plan_path(), reason));
        }
        if plan.job.run.batches > first.job.run.batches {
            common = Some(plan);
        }
    }
    common.ok_or_else(|| Error::input("command line", "DIR", "(none)", "at least one folder"))
}

/// A checkpoint whose header was read.
struct Candidate {
    path: PathBuf,
    header: Header,
}

/// For each shard the longest checkpoint. Everything that is wrong with any file is said at once.
fn choose(plan: &Plan, folders: &[Folder]) -> Result<BTreeMap<u64, Candidate>> {
    let mut chosen = BTreeMap::new();
    let mut refused = Vec::new();
    for folder in folders {
        for (shard, path) in folder.checkpoints()? {
            match read_checked(plan, shard, &path) {
                Ok(Some(header)) => consider(&mut chosen, Candidate { path, header }, &mut refused),
                Ok(None) => {}
                Err(Error::Refused { path, reason }) => refused.push((path, reason)),
                Err(e) => return Err(e),
            }
        }
    }
    let Some((path, mut reason)) = refused.pop() else { return Ok(chosen) };
    for (path, other) in refused {
        reason = format!("{reason}\n{}: refused: {other}", path.display());
    }
    Err(Error::Refused { path, reason })
}

fn read_checked(plan: &Plan, shard: u64, path: &Path) -> Result<Option<Header>> {
    let header = read_header(path, plan, shard)?;
    header.iter().try_for_each(|header| check_length(plan, shard, path, header))?;
    Ok(header)
}

/// Moments cannot be cut back to fewer batches, so a checkpoint beyond the plan is refused.
fn check_length(plan: &Plan, shard: u64, path: &Path, header: &Header) -> Result<()> {
    let start = shard.saturating_mul(plan.job.run.batches_per_shard);
    let end = start.saturating_add(header.batches());
    if header.batches() == 0 || end <= plan.job.run.batches {
        return Ok(());
    }
    let batches = plan.job.run.batches;
    let reason = format!("goes on to batch {end}, the plan ends at {batches}; set run.batches to at least {end}");
    Err(Error::refused(path, reason))
}

/// Takes `new` into account for its shard.
fn consider(chosen: &mut BTreeMap<u64, Candidate>, new: Candidate, refused: &mut Vec<(PathBuf, String)>) {
    let shard = new.header.shard;
    let Some(old) = chosen.get(&shard) else {
        chosen.insert(shard, new);
        return;
    };
    if let Some(i) = old.header.digests.iter().zip(&new.header.digests).position(|(a, b)| a != b) {
        let reason = |other: &Path| format!("batch {i} of the shard is another than in {}", other.display());
        refused.push((new.path.clone(), reason(&old.path)));
        refused.push((old.path.clone(), reason(&new.path)));
    } else if new.header.batches() > old.header.batches() {
        chosen.insert(shard, new);
    }
}

/// The left fold over shards.
struct Fold<'a> {
    plan: &'a Plan,
    shapes: Vec<SetShape>,
    sets: Vec<SetFold>,
    monitors: Vec<Vec<Monitor>>,
    flux: Replicates,
    /// Direct light of every set with the file and the checksums it was taken from.
    fixed: Option<(PathBuf, Vec<Checksum>, Vec<Vec<f64>>)>,
    batches: u64,
    seconds: f64,
    done: Vec<Range<u64>>,
}

/// One receiver set so far: maps as blocks, others whole.
enum SetFold {
    Moments(Vec<MomentBlock>),
    Replicates(Replicates),
}

impl<'a> Fold<'a> {
    fn new(plan: &'a Plan) -> Self {
        let shapes = plan.sets();
        let empty = |shape: &SetShape| match shape.kept {
            Kept::Moments { .. } => SetFold::Moments(Vec::new()),
            Kept::EveryBatch => SetFold::Replicates(Replicates::new(shape.bins())),
        };
        let sets = shapes.iter().map(empty).collect();
        let monitors = shapes.iter().map(Monitor::of_set).collect();
        let flux = Replicates::new(FLUX_BINS.len());
        Fold { plan, shapes, sets, monitors, flux, fixed: None, batches: 0, seconds: 0.0, done: Vec::new() }
    }

    /// Folds in the next shard.
    fn take(&mut self, file: &Candidate) -> Result<()> {
        let shard = file.header.shard;
        let gone = || Error::refused(&file.path, "changed while it was merged");
        let mut reader = Reader::open(&file.path, self.plan, shard)?.ok_or_else(gone)?;
        // A worker may have replaced it meanwhile: by a longer one, then.
        if !reader.header().digests.starts_with(&file.header.digests) {
            return Err(gone());
        }
        check_length(self.plan, shard, &file.path, reader.header())?;
        let n = reader.header().batches();
        self.take_fixed(&mut reader, &file.path)?;
        for (set, fold) in self.sets.iter_mut().enumerate() {
            match fold {
                SetFold::Moments(blocks) => {
                    take_blocks(blocks, &mut reader, set, &self.shapes[set], (self.batches, n))?
                }
                SetFold::Replicates(scores) => scores.append(reader.replicates(set)?),
            }
        }
        for (set, monitors) in self.monitors.iter_mut().enumerate() {
            let next = reader.monitors(set)?;
            monitors.iter_mut().zip(next).for_each(|(monitor, next)| monitor.append(next));
        }
        self.flux.append(reader.flux()?);
        let start = self.plan.shard(shard).start;
        self.done.push(start..start + n);
        self.batches += n;
        self.seconds += reader.header().seconds;
        Ok(())
    }

    /// Takes the direct light of the first file, and refuses a file with another.
    fn take_fixed(&mut self, reader: &mut Reader, path: &Path) -> Result<()> {
        let checksums = reader.fixed_direct_checksums();
        match &self.fixed {
            None => {
                let fixed = (0..self.shapes.len()).map(|set| reader.fixed_direct(set)).collect::<Result<_>>()?;
                self.fixed = Some((path.to_owned(), checksums, fixed));
                Ok(())
            }
            Some((_, known, _)) if *known == checksums => {
                // The bytes, too, must be those of the checksum.
                (0..self.shapes.len()).try_for_each(|set| reader.fixed_direct(set).map(|_| ()))
            }
            Some((first, ..)) => {
                let reason = format!("its direct light is another than in {}", first.display());
                Err(Error::refused(path, reason))
            }
        }
    }

    fn result(self) -> Merged {
        let missing = missing(self.plan.job.run.batches, &self.done);
        let fixed = self.fixed.map(|(.., fixed)| fixed).unwrap_or_default();
        let sets = self.sets.into_iter().zip(fixed).map(|(set, fixed_direct)| match set {
            SetFold::Moments(blocks) => {
                let mut bins = MomentBlock::default();
                blocks.into_iter().for_each(|block| bins.append(block));
                SetResult::Moments { bins, fixed_direct }
            }
            SetFold::Replicates(scores) => SetResult::Replicates { scores, fixed_direct },
        });
        let sets = sets.collect();
        Merged { sets, monitors: self.monitors, flux: self.flux, batches: self.batches, missing, seconds: self.seconds }
    }
}

/// Merges the blocks of one map over `n` = (batches so far, batches of this file).
fn take_blocks(
    blocks: &mut Vec<MomentBlock>,
    reader: &mut Reader,
    set: usize,
    shape: &SetShape,
    n: (u64, u64),
) -> Result<()> {
    for block in 0..block_count(shape) {
        let next = reader.moments(set, block)?;
        match blocks.get_mut(block as usize) {
            Some(sum) => sum.merge(n.0, &next, n.1),
            None => blocks.push(next),
        }
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
