//! What a checkpoint says about itself, and whether that can be true of a plan.

use super::{Checksum, MAX_HEADER, Section, layout, part_count, tally_sections};
use crate::farm::plan::Plan;
use crate::job::SetShape;
use crate::tally::FLUX_BINS;
use serde::{Deserialize, Serialize};

/// Longest name of instructions \[bytes\].
const LONGEST_INSTRUCTIONS: usize = 16;
/// Longest name of a machine \[bytes\].
const LONGEST_HOST: usize = 255;
/// What a header takes beside its lists, at most \[bytes\].
const HEADER_REST: u64 = 4096;
/// What a batch takes in a header, at most: its digest, and a run of its own \[bytes\].
const HEADER_BATCH: u64 = 16 + LONGEST_HOST as u64 + LONGEST_INSTRUCTIONS as u64 + 32;
/// What a section takes in a header, at most \[bytes\].
const HEADER_SECTION: u64 = 64;

/// What a checkpoint says about itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Digest of the plan.
    pub plan: [u8; 32],
    /// Shards of which the file holds batches.
    pub span: Span,
    /// Digest of each batch done, in order: their number is the number of batches.
    pub digests: Vec<Checksum>,
    /// Who computed them, in order.
    pub runs: Vec<Run>,
    /// When the file was written \[s since 1970\].
    pub written: u64,
    /// Median relative error so far, an estimate from this file alone; NaN when nothing is known.
    pub relative_error: f64,
    /// What was seen at the looks before these batches were folded into one; of a compaction only.
    pub looks: Vec<Judged>,
    /// What follows the header, in the order of the file.
    pub sections: Vec<Section>,
}

/// The shards of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Span {
    /// The first batches of the shard of this number.
    Shard(u64),
    /// A compaction: all batches of the shards before this number.
    Before(u64),
}

/// Consecutive batches by one worker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Their number.
    pub batches: u64,
    /// Machine.
    pub host: String,
    /// Instructions with which its kernels ran; no number depends on them.
    pub instructions: String,
    /// Time spent on them \[s\].
    pub seconds: f64,
}

/// What a look at a goal saw.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Judged {
    /// Digest of what was asked: receivers, share, confidence.
    pub question: Checksum,
    /// Batches before the look.
    pub batches: u64,
    /// The smallest goal that it would have reached \[1\].
    pub relative_half_width: f64,
    /// Number of the set that needs it.
    pub set: u32,
}

impl Run {
    /// `before`, and then `next`: as one run where the same worker goes on.
    pub fn after(before: &[Run], next: Run) -> Vec<Run> {
        let mut runs = before.to_vec();
        match runs.last_mut() {
            Some(last) if last.host == next.host && last.instructions == next.instructions => {
                last.batches += next.batches;
                last.seconds += next.seconds;
            }
            _ => runs.push(next),
        }
        runs
    }
}

impl Span {
    /// Shards before which a compaction holds everything; 0 of a single shard.
    pub fn shards(self) -> u64 {
        match self {
            Span::Before(end) => end,
            Span::Shard(_) => 0,
        }
    }

    /// Number of the first batch.
    pub fn start(self, plan: &Plan) -> u64 {
        match self {
            Span::Shard(k) => k.saturating_mul(plan.job.run.batches_per_shard),
            Span::Before(_) => 0,
        }
    }
}

impl Header {
    /// Number of batches done.
    pub fn batches(&self) -> u64 {
        self.digests.len() as u64
    }

    /// Shards before which a compaction holds everything; 0 of a single shard.
    pub fn shards(&self) -> u64 {
        self.span.shards()
    }

    /// Time spent on them \[s\].
    pub fn seconds(&self) -> f64 {
        self.runs.iter().fold(0.0, |sum, run| sum + run.seconds)
    }

    /// The machine that computed batch `i` of the file.
    pub fn host_of(&self, i: u64) -> &str {
        let mut end = 0;
        let of = self.runs.iter().find(|run| {
            end += run.batches;
            i < end
        });
        of.map_or("", |run| &run.host)
    }

    /// The digests of shard `k` in a compaction.
    pub fn digests_of(&self, plan: &Plan, k: u64) -> &[Checksum] {
        let n = plan.job.run.batches_per_shard as usize;
        let start = usize::try_from(k).unwrap_or(usize::MAX).saturating_mul(n).min(self.digests.len());
        &self.digests[start..start.saturating_add(n).min(self.digests.len())]
    }

    /// What a compaction of `plan` says of each of its shards, in order, without sections.
    pub fn parts(&self, plan: &Plan) -> Vec<Header> {
        // A run never crosses the end of a shard: each shard brought its own.
        let mut runs = self.runs.iter();
        let part = |k: u64| {
            let digests = self.digests_of(plan, k).to_vec();
            let (mut own, mut left) = (Vec::new(), digests.len() as u64);
            while left > 0 {
                let Some(run) = runs.next() else { break };
                left = left.saturating_sub(run.batches);
                own.push(run.clone());
            }
            let (plan, span, runs, looks, sections) = (self.plan, Span::Shard(k), own, Vec::new(), Vec::new());
            let (written, relative_error) = (self.written, self.relative_error);
            Header { plan, span, digests, runs, written, relative_error, looks, sections }
        };
        (0..self.shards()).map(part).collect()
    }

    /// Whether this can be the header of a file of `plan`, whose receiver sets are `shapes`, with the span `span`; None: any
    /// compaction.
    pub(super) fn check(&self, plan: &Plan, span: Option<u64>, shapes: &[SetShape]) -> Result<(), String> {
        let digest = plan.content_digest();
        if self.plan != *digest.as_bytes() {
            let theirs = blake3::Hash::from_bytes(self.plan).to_hex();
            return Err(format!("of another plan: digest {}, not {}", &theirs[..16], &digest.to_hex()[..16]));
        }
        self.check_span(plan.job.run.batches_per_shard, span)?;
        self.check_runs()?;
        if !self.sections.iter().map(|s| s.content).eq(layout(shapes, self.batches())) {
            return Err("damaged: its sections are not those of the plan".to_owned());
        }
        let looks = self.looks.iter().map(|look| look.batches);
        if !looks.clone().is_sorted() || looks.max().is_some_and(|last| last > self.batches()) {
            return Err("damaged: its looks are not in order".to_owned());
        }
        Ok(())
    }

    fn check_span(&self, of_shard: u64, span: Option<u64>) -> Result<(), String> {
        let batches = self.batches();
        match (self.span, span) {
            (Span::Shard(k), Some(shard)) if k != shard => Err(format!("holds shard {k}, not {shard}")),
            (Span::Shard(_), Some(_)) if batches > of_shard => {
                Err(format!("damaged: {batches} batches in a shard of {of_shard}"))
            }
            (Span::Shard(_), Some(_)) if !self.looks.is_empty() => Err("damaged: a shard has no looks".to_owned()),
            (Span::Before(end), None) if end == 0 || end.checked_mul(of_shard) != Some(batches) => {
                Err(format!("damaged: {batches} batches in {end} shards of {of_shard}"))
            }
            (Span::Shard(_), Some(_)) | (Span::Before(_), None) => Ok(()),
            (Span::Before(_), Some(shard)) => Err(format!("holds the first shards together, not shard {shard}")),
            (Span::Shard(k), None) => Err(format!("holds shard {k}, not the first shards together")),
        }
    }

    fn check_runs(&self) -> Result<(), String> {
        let batches = self.runs.iter().try_fold(0u64, |sum, run| sum.checked_add(run.batches));
        if batches != Some(self.batches()) {
            return Err("damaged: its runs are not its batches".to_owned());
        }
        for run in &self.runs {
            if !(run.seconds.is_finite() && run.seconds >= 0.0) {
                return Err("damaged: its time is not a time".to_owned());
            }
            let name = &run.instructions;
            if name.len() > LONGEST_INSTRUCTIONS || !name.bytes().all(|b| b.is_ascii_alphanumeric()) {
                return Err("damaged: its instructions have no such name".to_owned());
            }
            if run.host.len() > LONGEST_HOST || run.host.chars().any(char::is_control) {
                return Err("damaged: its machine has no such name".to_owned());
            }
        }
        Ok(())
    }
}

/// Longest header that a file of `plan` can have \[bytes\]: what is longer is not even read. A header takes some times its
/// length in memory, so the limit is of the plan's making and not of the file's.
pub(super) fn longest(plan: &Plan, span: Option<u64>, shapes: &[SetShape]) -> u64 {
    let run = &plan.job.run;
    let batches = if span.is_some() { run.batches_per_shard } else { run.batches };
    let of_tallies = shapes.iter().map(|shape| tally_sections(shape, batches) as u64).fold(0, u64::saturating_add);
    let of_flux = u64::from(part_count(FLUX_BINS.len(), batches)) + 1;
    let sections = of_tallies.saturating_add(of_flux).saturating_add(2 * shapes.len() as u64);
    let lists = batches.saturating_mul(HEADER_BATCH).saturating_add(sections.saturating_mul(HEADER_SECTION));
    lists.saturating_add(HEADER_REST).min(u64::from(MAX_HEADER))
}
