//! Passes over the maps: which blocks of bins are folded together, and how one file's are folded into them.

use super::blocks::bytes_of;
use crate::error::Result;
use crate::farm::checkpoint::{BLOCK, Reader, block_count};
use crate::job::SetShape;
use crate::tally::MomentBlock;
use rayon::prelude::*;
use std::ops::Range;

/// Blocks read, verified and merged at a time: some 10 MB, so that the threads have enough to share, and memory holds
/// little beside the pass.
const AT_ONCE: usize = 64;

/// Some blocks of a map.
pub(super) struct Part {
    /// Number of the receiver set.
    pub set: usize,
    /// Numbers of the blocks.
    pub blocks: Range<usize>,
}

/// The blocks of the maps among the sets numbered in `read`, divided into passes of about `memory` bytes; one pass at
/// least, for all that is no map.
pub(super) fn passes(shapes: &[SetShape], read: &[usize], memory: u64) -> Vec<Vec<Part>> {
    let (mut passes, mut pass, mut room) = (Vec::new(), Vec::new(), memory);
    for &set in read {
        let count = block_count(&shapes[set]) as usize;
        let of_block = bytes_of(&shapes[set]).min(BLOCK as u64 * 72);
        let mut next = 0;
        while of_block > 0 && next < count {
            let fits = ((room / of_block) as usize).min(count - next);
            if fits == 0 && !pass.is_empty() {
                passes.push(std::mem::take(&mut pass));
                room = memory;
                continue;
            }
            let blocks = next..next + fits.max(1);
            (next, room) = (blocks.end, room.saturating_sub(blocks.len() as u64 * of_block));
            pass.push(Part { set, blocks });
        }
    }
    passes.push(pass);
    passes
}

/// Merges the blocks of `part` over `n` = (batches so far, batches of this file), some at a time by all threads, while
/// the disk fetches the next ones.
pub(super) fn take_blocks(blocks: &mut [MomentBlock], reader: &Reader, part: &Part, n: (u64, u64)) -> Result<()> {
    let end = part.blocks.end;
    let numbers = |range: Range<usize>| range.start as u32..range.end as u32;
    reader.fetch(part.set, numbers(part.blocks.start..(part.blocks.start + AT_ONCE).min(end)));
    for (some, start) in blocks.chunks_mut(AT_ONCE).zip(part.blocks.clone().step_by(AT_ONCE)) {
        let next = start + some.len();
        reader.fetch(part.set, numbers(next..(next + AT_ONCE).min(end)));
        let take = |(sum, block): (&mut MomentBlock, usize)| {
            let of_file = reader.moments(part.set, block as u32)?;
            if sum.is_empty() {
                *sum = of_file
            } else {
                sum.merge(n.0, &of_file, n.1)
            }
            Ok(())
        };
        let taken: Vec<Result<()>> = some.par_iter_mut().zip(start..next).map(take).collect();
        // Of several damaged blocks the first is named, whichever thread came upon it first.
        taken.into_iter().collect::<Result<()>>()?;
    }
    Ok(())
}
