//! The moments of a map, block by block: in memory, or where they are many in a file without a name, so that memory does
//! not grow with the picture.

use crate::farm::checkpoint::{BLOCK, block_count, from_bytes, to_bytes};
use crate::job::{Kept, SetShape};
use crate::tally::MomentBlock;
use std::fs::File;
use std::io::{Error, ErrorKind, Result};
use std::os::unix::fs::FileExt;
use std::path::Path;

/// Moments of every bin of a map, in blocks of [`BLOCK`] bins; before anything was written into a block it is empty.
#[derive(Debug)]
pub struct Blocks {
    bins: usize,
    colour: bool,
    place: Place,
}

#[derive(Debug)]
enum Place {
    Memory(Vec<MomentBlock>),
    /// With which blocks were written.
    File(File, Vec<bool>),
}

impl Blocks {
    /// Empty blocks for the map `shape`; in a file in the folder `scratch` where one is given.
    ///
    /// # Errors
    /// Those of making the file.
    pub fn new(shape: &SetShape, scratch: Option<&Path>) -> Result<Blocks> {
        let blocks = block_count(shape) as usize;
        let place = match scratch {
            Some(folder) => Place::File(tempfile::tempfile_in(folder)?, vec![false; blocks]),
            None => Place::Memory(vec![MomentBlock::default(); blocks]),
        };
        Ok(Blocks { bins: shape.bins(), colour: shape.kept == Kept::Moments { colour: true }, place })
    }

    /// Number of bins.
    pub fn len(&self) -> usize {
        self.bins
    }

    /// True without bins.
    pub fn is_empty(&self) -> bool {
        self.bins == 0
    }

    /// Number of blocks.
    pub fn count(&self) -> usize {
        self.bins.div_ceil(BLOCK)
    }

    /// Block `i`, copied.
    ///
    /// # Errors
    /// Those of reading the file.
    pub fn read(&self, i: usize) -> Result<MomentBlock> {
        match &self.place {
            Place::Memory(blocks) => Ok(blocks[i].clone()),
            Place::File(_, written) if !written[i] => Ok(MomentBlock::default()),
            Place::File(file, _) => {
                let bins = BLOCK.min(self.bins - i * BLOCK);
                let mut bytes = vec![0; bins * self.bytes_of_bin()];
                file.read_exact_at(&mut bytes, self.offset(i))?;
                from_bytes(&bytes, bins, self.colour).ok_or_else(|| Error::from(ErrorKind::InvalidData))
            }
        }
    }

    /// Replaces block `i`.
    ///
    /// # Errors
    /// Those of writing the file.
    pub fn write(&mut self, i: usize, block: MomentBlock) -> Result<()> {
        let offset = self.offset(i);
        match &mut self.place {
            Place::Memory(blocks) => blocks[i] = block,
            Place::File(file, written) => {
                file.write_all_at(&to_bytes(&block, 0..block.len()), offset)?;
                written[i] = true;
            }
        }
        Ok(())
    }

    /// All bins together.
    ///
    /// # Errors
    /// Those of reading the file.
    pub fn whole(&self) -> Result<MomentBlock> {
        let mut bins = MomentBlock::default();
        (0..self.count()).try_for_each(|i| self.read(i).map(|block| bins.append(block)))?;
        Ok(bins)
    }

    fn bytes_of_bin(&self) -> usize {
        if self.colour { 72 } else { 48 }
    }

    fn offset(&self, i: usize) -> u64 {
        (i * BLOCK * self.bytes_of_bin()) as u64
    }
}

/// Bytes that the moments of `shape` take; 0 of a set that keeps its batches.
pub(super) fn bytes_of(shape: &SetShape) -> u64 {
    match shape.kept {
        Kept::Moments { colour } => shape.bins() as u64 * if colour { 72 } else { 48 },
        Kept::EveryBatch => 0,
    }
}

impl From<MomentBlock> for Blocks {
    fn from(bins: MomentBlock) -> Blocks {
        let (count, colour) = (bins.len(), !bins.colour.is_empty());
        let block = |start| bins.slice(start..(start + BLOCK).min(count));
        let blocks = (0..count).step_by(BLOCK).map(block).collect();
        Blocks { bins: count, colour, place: Place::Memory(blocks) }
    }
}

impl PartialEq for Blocks {
    fn eq(&self, other: &Blocks) -> bool {
        let same = |i| matches!((self.read(i), other.read(i)), (Ok(a), Ok(b)) if a == b);
        self.bins == other.bins && (0..self.count()).all(same)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::farm::checkpoint::block_range;
    use crate::job::ReceiverKind;

    #[test]
    fn a_file_gives_back_what_memory_does() {
        let (width, height, kept) = (70, 80, Kept::Moments { colour: true });
        let shape =
            SetShape { name: "x".into(), kind: ReceiverKind::Camera, width, height, kept, monitored: Vec::new() };
        let folder = tempfile::tempdir().unwrap();
        let mut filed = Blocks::new(&shape, Some(folder.path())).unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "a file without a name");
        assert!(filed.read(1).unwrap().is_empty());
        let mut bins = MomentBlock::new(shape.bins(), true);
        bins.mean.iter_mut().enumerate().for_each(|(i, x)| *x = (i as f64).sqrt());
        bins.colour.iter_mut().enumerate().for_each(|(i, c)| *c = [i as f64, 0.5, -1.0]);
        bins.existed.iter_mut().enumerate().for_each(|(i, n)| *n = i as u64);
        let held = Blocks::from(bins.clone());
        for block in (0..2).rev() {
            filed.write(block, bins.slice(block_range(&shape, block as u32))).unwrap();
        }
        assert!(filed == held && filed.whole().unwrap() == bins);
        filed.write(1, bins.slice(0..1504)).unwrap();
        assert!(filed != held);
    }
}
