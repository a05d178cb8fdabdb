//! The first shards of a folder folded into one file, the state of the fold after them: whoever goes on from it does what
//! would have been done anyway, so no bit changes.
//!
//! Only whole shards are taken, from the first one on without a gap, and never beyond a look at which the goal is reached; what
//! the looks before saw is kept in the file. The files that were folded are removed once their compaction is safe on the disk.

use super::choose::{Candidate, choose, common_plan};
use super::fold;
use super::fold::Fold;
use crate::error::{Error, Result};
use crate::farm::checkpoint::{
    Content, Draft, Span, encode_extremes, encode_moments, encode_plain, encode_scores, part_range, read_compaction,
    read_header, write_draft,
};
use crate::farm::folder::Folder;
use crate::farm::plan::Plan;
use crate::tally::EveryBatch;
use std::fs;
use std::io::{self, ErrorKind};

/// Batches that a compaction holds, at most: their digests stand in its header.
const MOST_BATCHES: u64 = 100_000;

/// What was compacted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Compacted {
    /// Shards before this number are in one file.
    pub shards: u64,
    /// Files that were folded into it just now.
    pub files: usize,
}

/// Folds the whole shards with which the plan in `folder` begins into one file, and removes theirs; `written` is the present
/// \[s since 1970\].
///
/// # Errors
/// As [`super::merge`]; nothing is removed then.
pub fn compact(folder: &Folder, written: u64) -> Result<Compacted> {
    let folders = std::slice::from_ref(folder);
    let plan = common_plan(folders)?;
    let files = beginning(&plan, choose(&plan, folders)?);
    let all = (0..plan.sets().len()).collect();
    let before = read_compaction(folder, &plan)?.map_or(0, |header| header.shards());
    if files.iter().any(|file| file.span.shards() == 0) {
        let fold = fold(&plan, &files, all, folder.root())?;
        if fold.batches() > before * plan.job.run.batches_per_shard {
            store(folder, &plan, &fold, written)?;
        }
    }
    let files = remove_contained(folder, &plan)?;
    let shards = read_compaction(folder, &plan)?.map_or(0, |header| header.shards());
    Ok(Compacted { shards, files })
}

/// True when `shards` whole ones lie in files of their own right behind what is compacted. Reads no more headers than that.
///
/// # Errors
/// Those of reading a header.
pub fn is_due(folder: &Folder, plan: &Plan, shards: u64) -> Result<bool> {
    let first = read_compaction(folder, plan)?.map_or(0, |header| header.shards());
    let n = plan.job.run.batches_per_shard;
    for shard in first..first.saturating_add(shards) {
        if read_header(&folder.shard_path(shard), plan, shard)?.is_none_or(|header| header.batches() != n) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// The files with which the plan begins: without a gap, each whole.
fn beginning(plan: &Plan, files: Vec<Candidate>) -> Vec<Candidate> {
    let mut end = 0;
    let goes_on = |file: &Candidate| {
        let range = file.range(plan);
        let whole = (range.end - range.start).is_multiple_of(plan.job.run.batches_per_shard) && !range.is_empty();
        let goes_on = range.start == end && whole && (range.end <= MOST_BATCHES || file.span.shards() > 0);
        end = range.end;
        goes_on
    };
    files.into_iter().take_while(goes_on).collect()
}

/// Writes the state of `fold`, its batches being those of whole shards.
fn store(folder: &Folder, plan: &Plan, fold: &Fold, written: u64) -> Result<()> {
    let encode = |content: Content| -> io::Result<Vec<u8>> {
        Ok(match content {
            Content::Moments { set, block } => {
                let block = fold.moments(set as usize).read(block as usize)?;
                encode_moments(&block, 0..block.len())
            }
            Content::Scores { set, part } => {
                let rows = fold.rows(set as usize);
                let [value, direct] = rows.entries(part_range(rows.bins(), fold.batches(), part))?;
                encode_scores(&value, &direct)
            }
            Content::Extremes { set } => encode_extremes(&fold.rows(set as usize).extremes()),
            Content::FixedDirect { set } => encode_plain(&fold.fixed_direct()[set as usize]),
            Content::Monitors { set } => encode_plain(&fold.monitors()[set as usize]),
        })
    };
    let draft = Draft {
        plan,
        span: Span::Before(fold.batches() / plan.job.run.batches_per_shard),
        digests: fold.digests(),
        runs: fold.runs(),
        looks: &fold.judged(),
        written,
        relative_error: f64::NAN,
    };
    write_draft(&folder.compaction_path(), &draft, &encode).map(|_| ())
}

/// Removes the files of the shards that the compaction in `folder` holds; how many there were.
fn remove_contained(folder: &Folder, plan: &Plan) -> Result<usize> {
    // What stands there now, whoever wrote it last.
    let Some(header) = read_compaction(folder, plan)? else { return Ok(0) };
    let contained = folder.checkpoints()?.into_iter().filter(|(shard, _)| *shard < header.shards());
    let mut removed = 0;
    for (_, path) in contained {
        match fs::remove_file(&path) {
            Err(e) if e.kind() == ErrorKind::NotFound => {}
            other => other.map_err(Error::io(&path))?,
        }
        removed += 1;
        // Its lock serves nobody any more: a worker of a shard that is whole writes nothing new.
        let _ = fs::remove_file(crate::farm::durable::lock_path(&path));
    }
    Ok(removed)
}

#[cfg(test)]
mod tests;
