//! One durable file for each shard: a prefix of its batches; and one for the first shards of a plan together, each
//! complete, a compaction. The format is described in docs/checkpoint-format.md.
//!
//! ```text
//! magic (8) | version u32 | header length u32 | header (postcard) | checksum (16) | sections
//! ```
//!
//! Integers are little-endian. The header names every section with offset, length and checksum, so status reads
//! headers alone and merging streams blocks of [`BLOCK`] bins. No generator state is kept: every draw is a function
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
pub use write::{Draft, Encode, Snapshot, encode_moments, encode_plain, encode_replicates, write, write_draft};

use crate::job::{Kept, SetShape};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// First bytes of every checkpoint; the last two find transfers that translate line ends.
pub const MAGIC: [u8; 8] = *b"LAMPYR\r\n";
/// Version of the format that this program writes and reads.
pub const VERSION: u32 = 4;
/// Bins of a map that are stored, checked and merged together.
pub const BLOCK: usize = 4096;
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

/// What a section holds; `set` counts receiver sets in job order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Content {
    /// A [`crate::tally::MomentBlock`]: bins `4096 block ..` of a set of which moments are kept.
    Moments {
        /// Receiver set.
        set: u32,
        /// Number of the block.
        block: u32,
    },
    /// [`crate::tally::Replicates`] of a set of which every batch is kept.
    Replicates {
        /// Receiver set.
        set: u32,
    },
    /// [`crate::tally::Replicates`] of the flux balance.
    Flux,
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

/// The sections that a checkpoint of the receiver sets `shapes` has, in the order of the file.
fn layout(shapes: &[SetShape]) -> Vec<Content> {
    let numbered = || (0u32..).zip(shapes);
    let tallies = numbered().flat_map(|(set, shape)| match shape.kept {
        Kept::Moments { .. } => (0..block_count(shape)).map(|block| Content::Moments { set, block }).collect(),
        Kept::EveryBatch => vec![Content::Replicates { set }],
    });
    let fixed = numbered().map(|(set, _)| Content::FixedDirect { set });
    let monitored = numbered().filter(|(_, shape)| !shape.monitored.is_empty());
    let monitors = monitored.map(|(set, _)| Content::Monitors { set });
    tallies.chain([Content::Flux]).chain(fixed).chain(monitors).collect()
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
