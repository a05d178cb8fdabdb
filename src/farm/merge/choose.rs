//! Which plan and which checkpoint files count, when several folders of one plan are merged.
//!
//! Of each shard the longest checkpoint, once the batch digests show the others to be its prefixes; of compactions the
//! longest one, which begin with batch 0 all and so are prefixes of each other too, and of shards that it holds nothing.
//! Only headers are read here.

use crate::error::{Error, Result};
use crate::farm::checkpoint::{Checksum, Header, Reader, Span, read_compaction, read_header};
use crate::farm::folder::Folder;
use crate::farm::plan::Plan;
use std::collections::BTreeMap;
use std::ops::Range;
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
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub path: PathBuf,
    pub span: Span,
    pub digests: Vec<Checksum>,
}

impl Candidate {
    fn of(path: PathBuf, header: Header) -> Self {
        Candidate { path, span: header.span, digests: header.digests }
    }

    /// Number of batches.
    pub fn batches(&self) -> u64 {
        self.digests.len() as u64
    }

    /// The range of its batches.
    pub fn range(&self, plan: &Plan) -> Range<u64> {
        let start = self.span.start(plan);
        start..start + self.batches()
    }

    /// Opens it again.
    ///
    /// # Errors
    /// [`Error::Refused`] when it has gone or is no longer the same.
    pub fn open(&self, plan: &Plan) -> Result<Reader> {
        let opened = match self.span {
            Span::Shard(k) => Reader::open(&self.path, plan, k)?,
            Span::Before(_) => Reader::open_compaction(&self.path, plan)?,
        };
        // A worker may have replaced it meanwhile: by a longer one, then.
        let reader = opened.filter(|reader| reader.header().digests.starts_with(&self.digests));
        let reader = reader.ok_or_else(|| Error::refused(&self.path, "changed while it was merged: merge again"))?;
        check_length(plan, &self.path, reader.header())?;
        Ok(reader)
    }
}

/// What is wrong with files, each with its reason.
type Refusals = Vec<(PathBuf, String)>;

/// The checkpoints that count, in the order of their batches: the longest compaction, and of each shard behind it the longest
/// one. Everything that is wrong with any file is said at once.
pub(super) fn choose(plan: &Plan, folders: &[Folder]) -> Result<Vec<Candidate>> {
    let (mut folded, mut shards, mut refused) = (None, BTreeMap::new(), Refusals::new());
    for folder in folders {
        for (shard, path) in folder.checkpoints()? {
            let header = read_header(&path, plan, shard);
            if let Some(new) = checked(plan, path, header, &mut refused)? {
                let longest = consider(shards.remove(&shard), new, &mut refused);
                shards.insert(shard, longest);
            }
        }
        // After the shards: what is compacted meanwhile is seen twice, and not missed.
        let header = read_compaction(folder, plan);
        if let Some(new) = checked(plan, folder.compaction_path(), header, &mut refused)? {
            folded = Some(consider(folded, new, &mut refused));
        }
    }
    if let Some(folded) = &folded {
        drop_contained(plan, folded, &mut shards, &mut refused);
    }
    let Some((path, mut reason)) = refused.pop() else {
        return Ok(folded.into_iter().chain(shards.into_values()).collect());
    };
    for (path, other) in refused {
        reason = format!("{reason}\n{}: refused: {other}", path.display());
    }
    Err(Error::Refused { path, reason })
}

/// The candidate at `path` with the header that was `read`; None without a file, or refused.
fn checked(
    plan: &Plan,
    path: PathBuf,
    read: Result<Option<Header>>,
    refused: &mut Refusals,
) -> Result<Option<Candidate>> {
    let read = read.and_then(|header| {
        header.iter().try_for_each(|header| check_length(plan, &path, header))?;
        Ok(header)
    });
    match read {
        Ok(header) => Ok(header.map(|header| Candidate::of(path, header))),
        Err(Error::Refused { path, reason }) => {
            refused.push((path, reason));
            Ok(None)
        }
        Err(e) => Err(e),
    }
}

/// Moments cannot be cut back to fewer batches, so a checkpoint beyond the plan is refused.
fn check_length(plan: &Plan, path: &Path, header: &Header) -> Result<()> {
    let end = header.span.start(plan).saturating_add(header.batches());
    if header.batches() == 0 || end <= plan.job.run.batches {
        return Ok(());
    }
    let batches = plan.job.run.batches;
    let field = plan.job.batches_field();
    let reason = format!("goes on to batch {end}, the plan ends at {batches}; set {field} to at least {end}");
    Err(Error::refused(path, reason))
}

/// The longer of two files of the same shards, once the shorter one is found to be its prefix.
fn consider(old: Option<Candidate>, new: Candidate, refused: &mut Refusals) -> Candidate {
    let Some(old) = old else { return new };
    if let Some(i) = first_difference(&old.digests, &new.digests) {
        contradict(&old.path, &new.path, &format!("batch {i} of {}", what(old.span)), refused);
    }
    if new.batches() > old.batches() { new } else { old }
}

fn what(span: Span) -> &'static str {
    match span {
        Span::Shard(_) => "the shard",
        Span::Before(_) => "the compaction",
    }
}

fn first_difference(a: &[Checksum], b: &[Checksum]) -> Option<usize> {
    a.iter().zip(b).position(|(a, b)| a != b)
}

/// Says of two files that a batch of one is another than in the other.
fn contradict(one: &Path, other: &Path, batch: &str, refused: &mut Refusals) {
    let reason = |other: &Path| format!("{batch} is another than in {}", other.display());
    refused.push((other.to_owned(), reason(one)));
    refused.push((one.to_owned(), reason(other)));
}

/// Takes the shards away that the compaction holds, once their batches are found to be those of the compaction.
fn drop_contained(plan: &Plan, folded: &Candidate, shards: &mut BTreeMap<u64, Candidate>, refused: &mut Refusals) {
    let n = plan.job.run.batches_per_shard as usize;
    shards.retain(|&shard, file| {
        let start = usize::try_from(shard).unwrap_or(usize::MAX).saturating_mul(n);
        let Some(held) = folded.digests.get(start..).filter(|held| !held.is_empty()) else { return true };
        if let Some(i) = first_difference(held, &file.digests) {
            contradict(&folded.path, &file.path, &format!("batch {i} of shard {shard}"), refused);
        }
        false
    });
}
