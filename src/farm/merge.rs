//! Checkpoints -> one result: a left fold over shards in shard order.

use crate::tally::{MomentBlock, Replicates};
use std::ops::Range;

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
    /// Flux balance, every batch.
    pub flux: Replicates,
    /// Batches merged.
    pub batches: u64,
    /// Batches of the plan that are missing, as half-open ranges.
    pub missing: Vec<Range<u64>>,
    /// Time spent by all workers \[s\].
    pub seconds: f64,
}
