//! Tally -> checkpoint file.

use super::columns::{encode_moments, encode_replicates};
use super::{Checksum, Content, Header, MAGIC, Section, VERSION, block_range, checksum, layout, read_header};
use crate::error::{Error, Result};
use crate::farm::durable;
use crate::farm::plan::Plan;
use crate::job::SetShape;
use crate::tally::{SetTally, Tally};
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
    /// Time spent on these batches \[s\].
    pub seconds: f64,
    /// The present \[s since 1970\].
    pub written: u64,
    /// This machine.
    pub host: &'a str,
    /// Instructions with which the kernels ran.
    pub instructions: &'a str,
    /// Median relative error so far.
    pub relative_error: f64,
}

/// Writes `snapshot` to `path`, durably; false when a checkpoint with more batches stands there and stays.
///
/// # Errors
/// [`Error::Refused`] when the file that stands there is not an older or newer state of the same shard: nothing is
/// overwritten then. [`Error::Io`].
pub fn write(path: &Path, snapshot: &Snapshot) -> Result<bool> {
    let shapes = snapshot.plan.sets();
    let contents = layout(&shapes);
    let header = header_bytes(snapshot, sections(snapshot, &shapes, &contents));
    durable::replace_if(path, |w| write_file(w, &header, snapshot, &shapes, &contents), || may_replace(path, snapshot))
}

/// Magic, version, length, header and checksum.
fn header_bytes(snapshot: &Snapshot, sections: Vec<Section>) -> Vec<u8> {
    let header = Header {
        plan: *snapshot.plan.content_digest().as_bytes(),
        shard: snapshot.shard,
        digests: snapshot.tally.digests.clone(),
        seconds: snapshot.seconds,
        written: snapshot.written,
        host: snapshot.host.to_owned(),
        instructions: snapshot.instructions.to_owned(),
        relative_error: snapshot.relative_error,
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
fn sections(snapshot: &Snapshot, shapes: &[SetShape], contents: &[Content]) -> Vec<Section> {
    let mut offset = 0;
    let describe = |&content: &Content| {
        let encoded = encode(content, snapshot, shapes);
        let section = Section { content, offset, bytes: encoded.len() as u64, checksum: checksum(&encoded) };
        offset += section.bytes;
        section
    };
    contents.iter().map(describe).collect()
}

fn write_file(
    w: &mut dyn Write,
    header: &[u8],
    snapshot: &Snapshot,
    shapes: &[SetShape],
    contents: &[Content],
) -> io::Result<()> {
    w.write_all(header)?;
    contents.iter().try_for_each(|&content| w.write_all(&encode(content, snapshot, shapes)))
}

fn encode(content: Content, snapshot: &Snapshot, shapes: &[SetShape]) -> Vec<u8> {
    let sets = &snapshot.tally.sets;
    let encoded = match content {
        Content::Moments { set, block } => match &sets[set as usize] {
            SetTally::Moments(m) => return encode_moments(&m.bins, block_range(&shapes[set as usize], block)),
            SetTally::Replicates(_) => unreachable!("the layout follows what the set keeps"),
        },
        Content::Replicates { set } => match &sets[set as usize] {
            SetTally::Replicates(r) => return encode_replicates(r),
            SetTally::Moments(_) => unreachable!("the layout follows what the set keeps"),
        },
        Content::Flux => return encode_replicates(&snapshot.tally.flux),
        Content::FixedDirect { set } => postcard::to_stdvec(&snapshot.fixed_direct[set as usize]),
        Content::Monitors { set } => postcard::to_stdvec(&snapshot.tally.monitors[set as usize]),
    };
    encoded.expect("plain data of known length always has a postcard form")
}

/// Whether the file at `path` is a state of the same shard with at most as many batches.
fn may_replace(path: &Path, snapshot: &Snapshot) -> Result<bool> {
    let Some(old) = read_header(path, snapshot.plan, snapshot.shard)? else { return Ok(true) };
    let new = &snapshot.tally.digests;
    if let Some(i) = old.digests.iter().zip(new).position(|(a, b)| a != b) {
        let reason =
            format!("its batch {i} of the shard is another than the one computed now; nothing was overwritten");
        return Err(Error::refused(path, reason));
    }
    Ok(old.digests.len() <= new.len())
}
