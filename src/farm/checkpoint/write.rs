//! Tally -> checkpoint file.

pub use super::columns::{encode_moments, encode_scores};
use super::{
    Checksum, Content, Header, Judged, MAGIC, Run, Section, Span, VERSION, block_range, checksum, layout, part_range,
};
use super::{Reader, read_header};
use crate::error::{Error, Result};
use crate::farm::durable;
use crate::farm::plan::Plan;
use crate::job::SetShape;
use crate::tally::{Replicates, SetTally, Tally};
use serde::Serialize;
use std::io::{self, Write};
use std::path::Path;

/// The state of a shard at one instant.
#[derive(Clone, Copy, Debug)]
pub struct Snapshot<'a> {
    /// The plan it belongs to.
    pub plan: &'a Plan,
    /// Number of the shard.
    pub shard: u64,
    /// Its batches so far.
    pub tally: &'a Tally,
    /// Direct light that is the same in every batch, one list a set.
    pub fixed_direct: &'a [Vec<f64>],
    /// Who computed these batches, in order.
    pub runs: &'a [Run],
    /// The present \[s since 1970\].
    pub written: u64,
    /// Median relative error so far.
    pub relative_error: f64,
}

/// What a file shall say of itself; its sections come from elsewhere.
#[derive(Clone, Copy, Debug)]
pub struct Draft<'a> {
    /// The plan it belongs to.
    pub plan: &'a Plan,
    /// Its shards.
    pub span: Span,
    /// Digests of its batches.
    pub digests: &'a [Checksum],
    /// Who computed them, in order.
    pub runs: &'a [Run],
    /// What was seen at the looks before; of a compaction only.
    pub looks: &'a [Judged],
    /// The present \[s since 1970\].
    pub written: u64,
    /// Median relative error so far.
    pub relative_error: f64,
}

/// Gives the bytes of a section, the same ones every time.
pub type Encode<'a> = &'a dyn Fn(Content) -> io::Result<Vec<u8>>;

/// Writes `snapshot` to `path`, durably; false when a checkpoint with more batches stands there and stays.
///
/// # Errors
/// [`Error::Refused`] when the file that stands there is not an older or newer state of the same shard: nothing is
/// overwritten then. [`Error::Io`].
pub fn write(path: &Path, snapshot: &Snapshot) -> Result<bool> {
    let shapes = snapshot.plan.sets();
    let draft = Draft {
        plan: snapshot.plan,
        span: Span::Shard(snapshot.shard),
        digests: &snapshot.tally.digests,
        runs: snapshot.runs,
        looks: &[],
        written: snapshot.written,
        relative_error: snapshot.relative_error,
    };
    write_draft(path, &draft, &|content| Ok(encode(content, snapshot, &shapes)))
}

/// Writes a file that says `draft` of itself, its sections by `encode`, durably; false when one with more batches stands
/// at `path` and stays.
///
/// # Errors
/// As [`write()`].
pub fn write_draft(path: &Path, draft: &Draft, encode: Encode) -> Result<bool> {
    let contents: Vec<Content> = layout(&draft.plan.sets(), draft.digests.len() as u64).collect();
    let header = header_bytes(draft, sections(&contents, encode).map_err(Error::io(path))?);
    durable::replace_if(path, |w| write_file(w, &header, &contents, encode), || may_replace(path, draft))
}

/// Magic, version, length, header and checksum.
fn header_bytes(draft: &Draft, sections: Vec<Section>) -> Vec<u8> {
    let header = Header {
        plan: *draft.plan.content_digest().as_bytes(),
        span: draft.span,
        digests: draft.digests.to_vec(),
        runs: draft.runs.to_vec(),
        written: draft.written,
        relative_error: draft.relative_error,
        looks: draft.looks.to_vec(),
        sections,
    };
    frame(&header, VERSION)
}

/// The bytes before the sections; `version` is a parameter for the test of newer versions only.
pub(super) fn frame(header: &Header, version: u32) -> Vec<u8> {
    let body = postcard::to_stdvec(header).expect("plain data of known length always has a postcard form");
    let length = u32::try_from(body.len()).expect("digests and sections are limited by the plan");
    let mut bytes = MAGIC.to_vec();
    bytes.extend(version.to_le_bytes());
    bytes.extend(length.to_le_bytes());
    bytes.extend(body);
    let sum: Checksum = checksum(&bytes);
    bytes.extend(sum);
    bytes
}

/// The table of sections. Every section is encoded here and once more when written, so that memory holds one
/// section and not the file.
fn sections(contents: &[Content], encode: Encode) -> io::Result<Vec<Section>> {
    let mut offset = 0;
    let describe = |&content: &Content| {
        let encoded = encode(content)?;
        let section = Section { content, offset, bytes: encoded.len() as u64, checksum: checksum(&encoded) };
        offset += section.bytes;
        Ok(section)
    };
    contents.iter().map(describe).collect()
}

fn write_file(w: &mut dyn Write, header: &[u8], contents: &[Content], encode: Encode) -> io::Result<()> {
    w.write_all(header)?;
    contents.iter().try_for_each(|&content| w.write_all(&encode(content)?))
}

fn encode(content: Content, snapshot: &Snapshot, shapes: &[SetShape]) -> Vec<u8> {
    let sets = &snapshot.tally.sets;
    match content {
        Content::Moments { set, block } => match &sets[set as usize] {
            SetTally::Moments(m) => encode_moments(&m.bins, block_range(&shapes[set as usize], block)),
            SetTally::Replicates(_) => unreachable!("the layout follows what the set keeps"),
        },
        Content::Scores { set, part } => {
            let scores = replicates(snapshot, set);
            let entries = part_range(scores.bins as usize, snapshot.tally.batches(), part);
            encode_scores(&scores.value[entries.clone()], &scores.direct[entries])
        }
        Content::Extremes { set } => encode_extremes(replicates(snapshot, set)),
        Content::FixedDirect { set } => encode_plain(&snapshot.fixed_direct[set as usize]),
        Content::Monitors { set } => encode_plain(&snapshot.tally.monitors[set as usize]),
    }
}

/// The batch scores of a set, or of the flux balance after the last one.
fn replicates<'a>(snapshot: &Snapshot<'a>, set: u32) -> &'a Replicates {
    match snapshot.tally.sets.get(set as usize) {
        Some(SetTally::Replicates(scores)) => scores,
        Some(SetTally::Moments(_)) => unreachable!("the layout follows what the set keeps"),
        None => &snapshot.tally.flux,
    }
}

/// What `scores` keeps of all batches together.
pub fn encode_extremes(scores: &Replicates) -> Vec<u8> {
    let Replicates { peak, caustic, existed, .. } = scores;
    postcard::to_stdvec(&(peak, caustic, existed)).expect("plain data of known length always has a postcard form")
}

/// Fixed direct light of a set, or its monitors.
pub fn encode_plain<T: Serialize>(values: &Vec<T>) -> Vec<u8> {
    postcard::to_stdvec(values).expect("plain data of known length always has a postcard form")
}

/// Whether the file at `path` is a state of the same shards with at most as many batches.
fn may_replace(path: &Path, draft: &Draft) -> Result<bool> {
    let old = match draft.span {
        Span::Shard(k) => read_header(path, draft.plan, k)?,
        Span::Before(_) => Reader::open_compaction(path, draft.plan)?.map(|reader| reader.header().clone()),
    };
    let Some(old) = old else { return Ok(true) };
    let new = draft.digests;
    if let Some(i) = old.digests.iter().zip(new).position(|(a, b)| a != b) {
        let reason = format!("its batch {i} is another than the one computed now; nothing was overwritten");
        return Err(Error::refused(path, reason));
    }
    Ok(old.digests.len() <= new.len())
}
