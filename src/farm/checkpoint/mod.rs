//! One durable file for each shard: a prefix of its batches; and one for the first shards of a plan together, each
//! complete, a compaction. The format is described in docs/checkpoint-format.md.
//!
//! ```text
//! magic (8) | version u32 | header length u32 | header (postcard) | checksum (16) | sections
//! ```
//!
//! Integers are little-endian. The header names every section with offset, length and checksum, so status reads
//! headers alone and merging streams blocks of [`BLOCK`] bins and parts of [`PART`] batch scores. No generator state is kept: every draw is a function
//! of the seed and an index, so "where are we" is the number of batches.
//!
//! A file is untrusted: nothing is allocated before its length is checked against the size of the file, nothing is
//! decoded before its checksum agrees, and nothing decoded is used before its shape is that of the plan.

mod columns;
mod header;
mod packed;
mod read;
mod write;

pub use columns::{from_bytes, to_bytes};
pub use header::{Header, Judged, Run, Span};
pub use read::{Reader, read_compaction, read_header, read_progress};
pub use write::{Draft, Encode, Snapshot, encode_extremes, encode_moments, encode_plain, encode_scores};
pub use write::{write, write_draft};

use crate::job::{Kept, SetShape};
use crate::tally::FLUX_BINS;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// First bytes of every checkpoint; the last two find transfers that translate line ends.
pub const MAGIC: [u8; 8] = *b"LAMPYR\r\n";
/// Version of the format that this program writes and reads.
pub const VERSION: u32 = 5;
/// Bins of a map that are stored, checked and merged together.
pub const BLOCK: usize = 4096;
/// Batch scores of a set that are stored, checked and merged together.
pub const PART: usize = 1 << 14;
/// Magic, version and header length \[bytes\].
const PREAMBLE: usize = 16;
/// Longest header \[bytes\]: that of a compaction of 10^5 batches and 10^5 shards fits with room.
const MAX_HEADER: u32 = 1 << 26;

/// The first 16 bytes of a BLAKE3 hash.
pub type Checksum = [u8; 16];

/// A run of bytes of one kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Section {
    /// What it holds.
    pub content: Content,
    /// Where it begins, counted from the end of the header's checksum \[bytes\].
    pub offset: u64,
    /// Its length \[bytes\].
    pub bytes: u64,
    /// Of its bytes.
    pub checksum: Checksum,
}

/// What a section holds; `set` counts receiver sets in job order, and the flux balance after the last of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Content {
    /// A [`crate::tally::MomentBlock`]: bins `4096 block ..` of a set of which moments are kept.
    Moments {
        /// Receiver set.
        set: u32,
        /// Number of the block.
        block: u32,
    },
    /// Entries `16384 part ..` of the scores and of the direct parts of a set of which every batch is kept, batch by batch.
    Scores {
        /// Receiver set.
        set: u32,
        /// Number of the part.
        part: u32,
    },
    /// What such a set keeps of all its batches together: the peak, the caustic light and the number of batches of each bin.
    Extremes {
        /// Receiver set.
        set: u32,
    },
    /// Direct light of a set that is the same in every batch; the same bytes in every shard.
    FixedDirect {
        /// Receiver set.
        set: u32,
    },
    /// A [`crate::tally::Monitor`] for each monitored bin of a set that has any.
    Monitors {
        /// Receiver set.
        set: u32,
    },
}

/// The sections that a file of `batches` of the receiver sets `shapes` has, in its order.
fn layout(shapes: &[SetShape], batches: u64) -> impl Iterator<Item = Content> + '_ {
    let numbered = || (0u32..).zip(shapes);
    let tallies = numbered().flat_map(move |(set, shape)| {
        let (blocks, kept) = match shape.kept {
            Kept::Moments { .. } => (block_count(shape), None),
            Kept::EveryBatch => (0, Some(kept_layout(set, shape.bins(), batches))),
        };
        (0..blocks).map(move |block| Content::Moments { set, block }).chain(kept.into_iter().flatten())
    });
    let flux = kept_layout(shapes.len() as u32, FLUX_BINS.len(), batches);
    let fixed = numbered().map(|(set, _)| Content::FixedDirect { set });
    let monitored = numbered().filter(|(_, shape)| !shape.monitored.is_empty());
    let monitors = monitored.map(|(set, _)| Content::Monitors { set });
    tallies.chain(flux).chain(fixed).chain(monitors)
}

/// The sections of a set of which every batch is kept.
fn kept_layout(set: u32, bins: usize, batches: u64) -> impl Iterator<Item = Content> {
    let parts = (0..part_count(bins, batches)).map(move |part| Content::Scores { set, part });
    parts.chain([Content::Extremes { set }])
}

/// Number of sections of a set in a file of `batches`, its fixed direct light and its monitored bins left out.
fn tally_sections(shape: &SetShape, batches: u64) -> usize {
    match shape.kept {
        Kept::Moments { .. } => block_count(shape) as usize,
        Kept::EveryBatch => part_count(shape.bins(), batches) as usize + 1,
    }
}

/// Number of parts of the scores of `bins` bins in `batches`.
pub fn part_count(bins: usize, batches: u64) -> u32 {
    let entries = (bins as u64).saturating_mul(batches);
    u32::try_from(entries.div_ceil(PART as u64)).unwrap_or(u32::MAX)
}

/// The entries `batch * bins + bin` of one part of the scores of `bins` bins in `batches`.
pub fn part_range(bins: usize, batches: u64, part: u32) -> Range<usize> {
    let entries = (bins as u64).saturating_mul(batches) as usize;
    let start = (part as usize).saturating_mul(PART).min(entries);
    start..start.saturating_add(PART).min(entries)
}

/// Number of blocks of a set of which moments are kept.
pub fn block_count(shape: &SetShape) -> u32 {
    u32::try_from(shape.bins().div_ceil(BLOCK)).expect("a job checked for at most 2^28 bins")
}

/// The bins of one block.
pub fn block_range(shape: &SetShape, block: u32) -> Range<usize> {
    let start = block as usize * BLOCK;
    start..(start + BLOCK).min(shape.bins())
}

fn checksum(bytes: &[u8]) -> Checksum {
    blake3::hash(bytes).as_bytes()[..16].try_into().expect("a hash is longer than 16 bytes")
}

#[cfg(test)]
mod tests;
