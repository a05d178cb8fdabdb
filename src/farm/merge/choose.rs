//! Which plan and which checkpoint files count, when several folders of one plan are merged.
//!
//! Of each shard the longest checkpoint, once the batch digests show the others to be its prefixes. Only headers are
//! read here.

use crate::error::{Error, Result};
use crate::farm::checkpoint::{Header, read_header};
use crate::farm::folder::Folder;
use crate::farm::plan::Plan;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The plan of all folders; the one with the most batches where they differ in that.
pub(super) fn common_plan(folders: &[Folder]) -> Result<Plan> {
    let plans: Vec<Plan> = folders.iter().map(Folder::read_plan).collect::<Result<_>>()?;
    let Some(first) = plans.first() else {
        return Err(Error::input("command line", "DIR", "(none)", "at least one folder"));
    };
    let longest = plans.iter().fold(first, |a, b| if b.job.run.batches > a.job.run.batches { b } else { a });
    for (folder, plan) in folders.iter().zip(&plans) {
        let differences = plan.differences(first);
        if !differences.is_empty() {
            let reason = format!("another plan than that of the first folder:\n  {}", differences.join("\n  "));
            return Err(Error::refused(&folder.plan_path(), reason));
        }
        // Which of two wishes counted would depend on the order of the folders, and the result on that.
        let other = other_wishes(plan, longest);
        if plan.job.run.batches == longest.job.run.batches && !other.is_empty() {
            let other = other.join(" and ");
            let reason = format!("another {other} than in a folder before it: plan the job on both folders first");
            return Err(Error::refused(&folder.plan_path(), reason));
        }
    }
    Ok(longest.clone())
}

/// The fields, apart from the number of batches, in which two plans of the same shards ask for other results.
fn other_wishes(a: &Plan, b: &Plan) -> Vec<&'static str> {
    let (a, b) = (&a.job, &b.job);
    let fields = [
        ("[stop]", a.stop != b.stop),
        ("run.confidence", a.run.confidence != b.run.confidence),
        ("[[ratio]]", a.ratios != b.ratios),
    ];
    fields.into_iter().filter_map(|(field, differs)| differs.then_some(field)).collect()
}

/// A checkpoint whose header was read.
pub(super) struct Candidate {
    pub path: PathBuf,
    pub header: Header,
}

/// For each shard the longest checkpoint. Everything that is wrong with any file is said at once.
pub(super) fn choose(plan: &Plan, folders: &[Folder]) -> Result<BTreeMap<u64, Candidate>> {
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
pub(super) fn check_length(plan: &Plan, shard: u64, path: &Path, header: &Header) -> Result<()> {
    let start = shard.saturating_mul(plan.job.run.batches_per_shard);
    let end = start.saturating_add(header.batches());
    if header.batches() == 0 || end <= plan.job.run.batches {
        return Ok(());
    }
    let batches = plan.job.run.batches;
    let field = plan.job.batches_field();
    let reason = format!("goes on to batch {end}, the plan ends at {batches}; set {field} to at least {end}");
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
