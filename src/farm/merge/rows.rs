//! Every batch's score of a set: in memory, or where they are many in a file without a name, so that memory does not grow
//! with the number of batches.
//!
//! The file holds slabs of some batches each. In a slab the scores of a bin lie together, its direct parts behind them: whoever
//! wants some bins of all batches reads one run of bytes of each slab.

use crate::farm::checkpoint::{PART, part_count, part_range};
use crate::tally::{EveryBatch, Replicates};
use std::fs::File;
use std::io::Result;
use std::ops::Range;
use std::os::unix::fs::FileExt;
use std::path::Path;

/// Scores of some bins of all batches that are held at a time, about.
const GROUP: usize = 1 << 17;
/// A score and its direct part \[bytes\].
const ENTRY: usize = 16;

/// The batch scores of a set of which every batch is kept.
#[derive(Debug)]
pub struct Rows {
    /// The batches that are not in the file, whole or not, and what is kept of all batches together.
    rest: Replicates,
    slabs: Option<Slabs>,
}

/// The batches before the rest, in a file.
#[derive(Debug)]
struct Slabs {
    file: File,
    count: usize,
}

impl Rows {
    /// No batches yet of `bins` bins; in a file in the folder `scratch` where one is given.
    ///
    /// # Errors
    /// Those of making the file.
    pub fn new(bins: usize, scratch: Option<&Path>) -> Result<Rows> {
        let slabs = scratch.map(|folder| tempfile::tempfile_in(folder).map(|file| Slabs { file, count: 0 }));
        Ok(Rows { rest: Replicates::new(bins), slabs: slabs.transpose()? })
    }

    /// Takes in what the next batches keep together; their scores follow with [`Rows::extend`].
    pub fn append(&mut self, extremes: Replicates) {
        self.rest.append(extremes);
    }

    /// Takes in the next scores and direct parts, batch by batch, wherever they begin and end.
    ///
    /// # Errors
    /// Those of writing the file.
    pub fn extend(&mut self, [value, direct]: [Vec<f64>; 2]) -> Result<()> {
        self.rest.value.extend(value);
        self.rest.direct.extend(direct);
        let (bins, batches) = (self.bins(), self.of_slab());
        let Some(slabs) = &mut self.slabs else { return Ok(()) };
        while bins > 0 && self.rest.value.len() >= bins * batches {
            let taken = |column: &mut Vec<f64>| column.drain(..bins * batches).collect::<Vec<f64>>();
            let (value, direct) = (taken(&mut self.rest.value), taken(&mut self.rest.direct));
            let mut bytes = Vec::with_capacity(bins * batches * ENTRY);
            for bin in 0..bins {
                for column in [&value, &direct] {
                    column.iter().skip(bin).step_by(bins).for_each(|x| bytes.extend(x.to_le_bytes()));
                }
            }
            slabs.file.write_all_at(&bytes, (slabs.count * bytes.len()) as u64)?;
            slabs.count += 1;
        }
        Ok(())
    }

    /// What is kept of all batches together, as of no batch.
    pub fn extremes(&self) -> Replicates {
        let Replicates { peak, caustic, existed, .. } = self.rest.clone();
        Replicates { peak, caustic, existed, ..Replicates::new(self.bins()) }
    }

    /// The scores and direct parts of `entries`, counted batch by batch.
    ///
    /// # Errors
    /// Those of reading the file.
    pub fn entries(&self, entries: Range<usize>) -> Result<[Vec<f64>; 2]> {
        let (bins, of_slab) = (self.bins(), self.of_slab() * self.bins());
        let (mut value, mut direct) = (Vec::with_capacity(entries.len()), Vec::with_capacity(entries.len()));
        let mut next = entries.start;
        while next < entries.end.min(self.in_file() * bins) {
            let slab = next / of_slab;
            let group = self.group(0..bins, slab..slab + 1)?;
            let of_group = next - slab * of_slab..(entries.end - slab * of_slab).min(of_slab);
            next += of_group.len();
            value.extend(&group.value[of_group.clone()]);
            direct.extend(&group.direct[of_group]);
        }
        let behind = self.in_file() * bins;
        let rest = next.max(behind) - behind..entries.end.max(behind) - behind;
        value.extend(&self.rest.value[rest.clone()]);
        direct.extend(&self.rest.direct[rest]);
        Ok([value, direct])
    }

    /// All batches together.
    ///
    /// # Errors
    /// Those of reading the file.
    pub fn whole(&self) -> Result<Replicates> {
        let [value, direct] = self.entries(0..self.bins() * EveryBatch::batches(self) as usize)?;
        Ok(Replicates { value, direct, ..self.extremes() })
    }

    /// Batches of a slab.
    fn of_slab(&self) -> usize {
        (PART / self.bins().max(1)).max(1)
    }

    /// Batches in the file.
    fn in_file(&self) -> usize {
        self.slabs.as_ref().map_or(0, |slabs| slabs.count * self.of_slab())
    }

    /// The bins `bins` in the batches of some slabs.
    fn group(&self, bins: Range<usize>, slabs: Range<usize>) -> Result<Replicates> {
        let (n, batches) = (bins.len(), self.of_slab());
        let mut group = Replicates::new(n);
        group.value.resize(n * batches * slabs.len(), 0.0);
        group.direct.resize(n * batches * slabs.len(), 0.0);
        let mut bytes = vec![0; n * batches * ENTRY];
        for (k, slab) in slabs.enumerate() {
            let at = (slab * self.bins() + bins.start) * batches * ENTRY;
            self.slabs.as_ref().map_or(Ok(()), |slabs| slabs.file.read_exact_at(&mut bytes, at as u64))?;
            let mut columns = bytes.chunks_exact(8 * batches);
            for bin in 0..n {
                for to in [&mut group.value, &mut group.direct] {
                    let words = columns.next().unwrap_or_default().as_chunks().0;
                    let entries = to[k * batches * n..].iter_mut().skip(bin).step_by(n);
                    entries.zip(words).for_each(|(x, word)| *x = f64::from_le_bytes(*word));
                }
            }
        }
        Ok(group)
    }
}

impl EveryBatch for Rows {
    fn bins(&self) -> usize {
        self.rest.bins as usize
    }

    fn batches(&self) -> u64 {
        self.in_file() as u64 + self.rest.batches()
    }

    fn each(&self, take: &mut dyn FnMut(usize, &Replicates)) -> Result<()> {
        let Some(slabs) = self.slabs.as_ref().filter(|slabs| slabs.count > 0) else { return self.rest.each(take) };
        let (bins, batches) = (self.bins(), EveryBatch::batches(self) as usize);
        let of_group = (GROUP / batches).max(1);
        for start in (0..bins).step_by(of_group) {
            let range = start..(start + of_group).min(bins);
            let mut group = self.group(range.clone(), 0..slabs.count)?;
            let rows = self.rest.value.chunks_exact(bins).zip(self.rest.direct.chunks_exact(bins));
            for (value, direct) in rows {
                group.value.extend(&value[range.clone()]);
                group.direct.extend(&direct[range.clone()]);
            }
            group.peak.copy_from_slice(&self.rest.peak[range.clone()]);
            group.caustic.copy_from_slice(&self.rest.caustic[range.clone()]);
            group.existed.copy_from_slice(&self.rest.existed[range]);
            take(start, &group);
        }
        Ok(())
    }
}

impl From<Replicates> for Rows {
    fn from(rest: Replicates) -> Rows {
        Rows { rest, slabs: None }
    }
}

impl PartialEq for Rows {
    fn eq(&self, other: &Rows) -> bool {
        let (bins, batches) = (self.bins(), EveryBatch::batches(self));
        let same = |part| {
            let entries = part_range(bins, batches, part);
            matches!((self.entries(entries.clone()), other.entries(entries)), (Ok(a), Ok(b)) if a == b)
        };
        self.extremes() == other.extremes()
            && batches == EveryBatch::batches(other)
            && (0..part_count(bins, batches)).all(same)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Made-up batches of some bins.
    fn replicates(bins: usize, batches: usize) -> Replicates {
        let mut scores = Replicates::new(bins);
        for batch in 0..batches {
            let value: Vec<f64> = (0..bins).map(|bin| ((batch * bins + bin) as f64).sqrt()).collect();
            let direct: Vec<f64> = value.iter().map(|x| 0.25 * x).collect();
            scores.accumulate(&value, &direct);
        }
        scores
    }

    #[test]
    fn a_file_gives_back_what_memory_does() {
        let folder = tempfile::tempdir().unwrap();
        // Several slabs and a rest; a rest alone; slabs of one batch; more bins than a group holds.
        for (bins, batches) in [(1000, 50), (65, 700), (3, 40), (PART + 1, 9), (1, 20_000)] {
            let scores = replicates(bins, batches);
            let mut filed = Rows::new(bins, Some(folder.path())).unwrap();
            filed.append(Replicates { value: Vec::new(), direct: Vec::new(), ..scores.clone() });
            let mut end = 0;
            // In pieces that end within a batch.
            for piece in [1, 777, 16384].into_iter().cycle() {
                let range = end..(end + piece).min(scores.value.len());
                end = range.end;
                filed.extend([scores.value[range.clone()].to_vec(), scores.direct[range].to_vec()]).unwrap();
                if end == scores.value.len() {
                    break;
                }
            }
            assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "a file without a name");
            assert!(filed.rest.value.len() < bins * filed.of_slab(), "the rest is less than a slab");
            assert_eq!(filed.whole().unwrap(), scores, "{bins} x {batches}");
            assert!(filed == Rows::from(scores.clone()));
            let mut seen = 0;
            filed
                .each(&mut |first, group| {
                    assert_eq!((first, group.batches()), (seen, batches as u64));
                    for bin in 0..group.bins as usize {
                        assert!(
                            group.scores(bin).eq(scores.scores(first + bin)),
                            "{bins} x {batches}: {first} + {bin}"
                        );
                        assert_eq!(group.direct_mean(bin), scores.direct_mean(first + bin));
                        assert_eq!(group.peak[bin], scores.peak[first + bin]);
                    }
                    seen += group.bins as usize;
                })
                .unwrap();
            assert_eq!(seen, bins);
            let mut other = scores.clone();
            other.direct[bins * batches / 2] += 1.0;
            assert!(filed != Rows::from(other));
        }
    }
}
