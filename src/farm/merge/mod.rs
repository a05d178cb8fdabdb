//! Checkpoints -> one result: a left fold over shards in shard order.
//!
//! Of each shard the longest checkpoint counts, once the batch digests show the others to be its prefixes; so
//! copies count once and the order of the folders changes nothing; plans that ask for other results are refused. Shards that
//! were compacted ([`compact`]) are the beginning of the fold, as it was stored.
//! Files are read one after the other, a few blocks of bins at a time, and what does not fit into a fixed amount of memory is
//! kept in a file without a name, so memory depends neither on the number of shards nor on the size of the pictures.
//! Threads share the blocks of a file; every block is folded in shard order, so their number changes no bit. A file
//! that cannot be trusted stops the merge and is named, with the reason. Merging knows neither
//! scene nor random numbers.
//!
//! With a goal ([`goal`]) the fold ends at the first look of the plan at which it is reached. A look is judged once
//! every shard before it is complete, and by these shards alone, so the result is a function of the checkpoint
//! files: batches beyond it, by workers that ran ahead, change nothing.

mod blocks;
mod choose;
pub mod compact;
mod fold;
pub mod goal;
mod passes;
mod rows;
pub mod settle;

pub use blocks::Blocks;
pub use rows::Rows;

use super::folder::Folder;
use super::plan::Plan;
use crate::error::{Error, Result};
use crate::tally::Monitor;
use choose::{Candidate, choose, common_plan};
use fold::Fold;
use goal::{Goal, Look, Stopped};
use std::ops::Range;
use std::path::Path;

/// The result of one receiver set.
#[derive(Debug, PartialEq)]
pub enum SetResult {
    /// Moments of batch scores, for maps, and the part that is the same in every batch.
    Moments {
        /// Mean, M2, direct, peak, colour of each bin.
        bins: Blocks,
        /// Direct light that is the same in every batch, one entry a bin (NaN: no receiver there, inside a solid
        /// or behind a surface), or empty for zero everywhere.
        fixed_direct: Vec<f64>,
    },
    /// Every batch's score, for grids and points, and the part that is the same in every batch.
    Replicates {
        /// Batch scores of each bin.
        scores: Rows,
        /// Direct light that is the same in every batch, one entry a bin (NaN: no receiver there, inside a solid
        /// or behind a surface), or empty for zero everywhere.
        fixed_direct: Vec<f64>,
    },
}

/// What all shards together say.
#[derive(Debug, PartialEq)]
pub struct Merged {
    /// One for each receiver set in job order.
    pub sets: Vec<SetResult>,
    /// For each receiver set its monitored bins, in their order.
    pub monitors: Vec<Vec<Monitor>>,
    /// Flux balance, every batch.
    pub flux: Rows,
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

/// Merges the checkpoints in `folders`, all of one plan; with them the plan, the longest when some were extended. What does
/// not fit into memory is kept in the folder `scratch`.
///
/// # Errors
/// [`Error::Refused`] naming every checkpoint that is damaged, foreign or of a newer version, or two that
/// contradict each other; [`Error::Input`] for a folder without a plan; [`Error::Io`].
pub fn merge(folders: &[Folder], scratch: &Path) -> Result<(Plan, Merged)> {
    let plan = common_plan(folders)?;
    let chosen = choose(&plan, folders)?;
    if chosen.is_empty() {
        let path = folders.first().map_or(Path::new("."), |f| f.root());
        return Err(Error::refused(path, "holds no checkpoint yet: nothing to merge"));
    }
    let read = (0..plan.sets().len()).collect();
    let merged = fold(&plan, &chosen, read, scratch)?.result();
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
/// without a goal. Reads no file that begins beyond the last of them, and beside headers and flux nothing of the sets that the goal
/// does not ask for.
///
/// # Errors
/// As [`merge`].
pub fn looks(folders: &[Folder]) -> Result<Vec<Look>> {
    let plan = common_plan(folders)?;
    let Some(goal) = Goal::of(&plan) else { return Ok(Vec::new()) };
    let mut chosen = choose(&plan, folders)?;
    let last = plan.last_look(chosen.iter().map(|c| c.range(&plan))).unwrap_or(0);
    chosen.retain(|c| c.range(&plan).start < last);
    let scratch = folders.first().map_or(Path::new("."), |f| f.root());
    Ok(fold(&plan, &chosen, goal.sets(), scratch)?.result().looks)
}

/// Folds the sets numbered in `read` file after file, up to the look at which the goal is reached.
fn fold<'a>(plan: &'a Plan, files: &[Candidate], read: Vec<usize>, scratch: &'a Path) -> Result<Fold<'a>> {
    let mut fold = Fold::new(plan, read, scratch)?;
    let mut rest = files;
    while !rest.is_empty() && !fold.reached() {
        let (next, after) = rest.split_at(up_to_a_look(plan, fold.batches(), rest));
        fold.take(next)?;
        rest = after;
    }
    Ok(fold)
}

/// How many of `files` end at the next look behind `batches`, all batches before it being there; all where there is none.
fn up_to_a_look(plan: &Plan, batches: u64, files: &[Candidate]) -> usize {
    let looks = plan.looks();
    let mut end = batches;
    for (i, file) in files.iter().enumerate() {
        let range = file.range(plan);
        if range.start != end {
            // With a gap behind it a look cannot be judged, and none after it.
            break;
        }
        end = range.end;
        if looks.contains(&end) {
            return i + 1;
        }
    }
    files.len()
}

#[cfg(test)]
mod tests;
