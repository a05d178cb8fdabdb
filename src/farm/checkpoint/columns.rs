//! Sections of numbers in postcard's form, a whole column at a time.
//!
//! A list of f64 is its length as a varint and eight little-endian bytes for each entry. Postcard's own serializer goes
//! through them byte by byte; these functions give and take the same bytes (a test compares them) at the speed of
//! memory, which is what merging and writing large maps need. They know columns, not what stands in them.

use crate::tally::{MomentBlock, Replicates};
use std::ops::Range;

/// The bins `range` of `bins`, as postcard would write a block of them.
pub(super) fn encode_moments(bins: &MomentBlock, range: Range<usize>) -> Vec<u8> {
    let MomentBlock { mean, m2, direct, peak, caustic, existed, colour } = bins;
    let mut to = Vec::with_capacity(range.len() * (5 * 8 + 2 + if colour.is_empty() { 0 } else { 3 * 8 }) + 64);
    for column in [mean, m2, direct, peak, caustic] {
        put_numbers(&mut to, range.len(), &column[range.clone()]);
    }
    put_counts(&mut to, &existed[range.clone()]);
    let colour = if colour.is_empty() { &[][..] } else { &colour[range] };
    put_numbers(&mut to, colour.len(), colour.as_flattened());
    to
}

/// The block in `bytes`; None where they are anything else.
pub(super) fn decode_moments(bytes: &[u8]) -> Option<MomentBlock> {
    let mut from = Columns(bytes);
    let [mean, m2, direct, peak, caustic] =
        [from.numbers()?, from.numbers()?, from.numbers()?, from.numbers()?, from.numbers()?];
    let (existed, colour) = (from.counts()?, from.triples()?);
    from.end(MomentBlock { mean, m2, direct, peak, caustic, existed, colour })
}

/// `scores`, as postcard would write them.
pub(super) fn encode_replicates(scores: &Replicates) -> Vec<u8> {
    let Replicates { bins, value, direct, peak, caustic, existed } = scores;
    let mut to = Vec::with_capacity(8 * (value.len() + direct.len()) + (2 * 8 + 2) * peak.len() + 64);
    put_count(&mut to, *bins);
    for column in [value, direct, peak, caustic] {
        put_numbers(&mut to, column.len(), column);
    }
    put_counts(&mut to, existed);
    to
}

/// The batch scores in `bytes`; None where they are anything else.
pub(super) fn decode_replicates(bytes: &[u8]) -> Option<Replicates> {
    let mut from = Columns(bytes);
    let bins = from.count()?;
    let [value, direct, peak, caustic] = [from.numbers()?, from.numbers()?, from.numbers()?, from.numbers()?];
    let existed = from.counts()?;
    from.end(Replicates { bins, value, direct, peak, caustic, existed })
}

/// A list of `entries` entries, their numbers one after the other.
fn put_numbers(to: &mut Vec<u8>, entries: usize, numbers: &[f64]) {
    put_count(to, entries as u64);
    let start = to.len();
    to.resize(start + 8 * numbers.len(), 0);
    to[start..].as_chunks_mut().0.iter_mut().zip(numbers).for_each(|(bytes, x)| *bytes = x.to_le_bytes());
}

fn put_counts(to: &mut Vec<u8>, counts: &[u64]) {
    put_count(to, counts.len() as u64);
    counts.iter().for_each(|&count| put_count(to, count));
}

/// A varint: seven bits a byte, the lowest first, the highest bit set where more follow.
fn put_count(to: &mut Vec<u8>, mut count: u64) {
    while count >= 0x80 {
        to.push(count as u8 | 0x80);
        count >>= 7;
    }
    to.push(count as u8);
}

/// What is left to be read. Every length is checked against it before anything is allocated.
struct Columns<'a>(&'a [u8]);

impl Columns<'_> {
    fn count(&mut self) -> Option<u64> {
        match self.0.split_first() {
            // Nearly all are small.
            Some((&small @ ..0x80, rest)) => {
                self.0 = rest;
                Some(u64::from(small))
            }
            _ => {
                let (count, rest) = postcard::take_from_bytes(self.0).ok()?;
                self.0 = rest;
                Some(count)
            }
        }
    }

    /// The bytes of a list whose entries have `size` bytes each.
    fn entries(&mut self, size: usize) -> Option<&[u8]> {
        let length = usize::try_from(self.count()?).ok()?.checked_mul(size)?;
        let (entries, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(entries)
    }

    fn numbers(&mut self) -> Option<Vec<f64>> {
        let (numbers, _) = self.entries(8)?.as_chunks();
        Some(numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect())
    }

    fn triples(&mut self) -> Option<Vec<[f64; 3]>> {
        let (triples, _) = self.entries(24)?.as_chunks::<8>().0.as_chunks();
        Some(triples.iter().map(|triple| triple.map(f64::from_le_bytes)).collect())
    }

    fn counts(&mut self) -> Option<Vec<u64>> {
        let length = usize::try_from(self.count()?).ok()?;
        // Each takes a byte or more.
        (length <= self.0.len()).then(|| (0..length).map(|_| self.count()).collect())?
    }

    /// `read`, if nothing is left.
    fn end<T>(self, read: T) -> Option<T> {
        self.0.is_empty().then_some(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of every kind, counts of every length.
    fn block(bins: usize, colour: bool) -> MomentBlock {
        let special = [0.0, -0.0, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE / 3.0, -1.5e300];
        let column = |k: usize| (0..bins).map(|i| special[(i + k) % 6] + (i / 6) as f64).collect();
        let existed = (0..bins).map(|i| u64::MAX >> (i * 7 % 64)).collect();
        let colour = (0..if colour { bins } else { 0 }).map(|i| [i as f64, 0.5, -0.0]).collect();
        MomentBlock {
            mean: column(0),
            m2: column(1),
            direct: column(2),
            peak: column(3),
            caustic: column(4),
            existed,
            colour,
        }
    }

    /// Bits, so that NaN equals itself.
    fn bytes<T: serde::Serialize>(x: &T) -> Vec<u8> {
        postcard::to_stdvec(x).unwrap()
    }

    #[test]
    fn the_bytes_are_those_of_postcard() {
        for (bins, colour) in [(0, false), (1, true), (127, false), (128, true), (300, true)] {
            let block = block(bins, colour);
            let encoded = encode_moments(&block, 0..bins);
            assert_eq!(encoded, bytes(&block), "{bins}");
            assert_eq!(bytes(&decode_moments(&encoded).unwrap()), encoded, "{bins}");
            let part = bins / 3..bins;
            assert_eq!(encode_moments(&block, part.clone()), bytes(&block.slice(part)), "{bins}");
            let MomentBlock { mean, m2, peak, caustic, existed, .. } = block;
            let scores = Replicates { bins: bins as u64, value: mean, direct: m2, peak, caustic, existed };
            let encoded = encode_replicates(&scores);
            assert_eq!(encoded, bytes(&scores), "{bins}");
            assert_eq!(bytes(&decode_replicates(&encoded).unwrap()), encoded, "{bins}");
        }
    }

    #[test]
    fn cut_lengthened_and_impossible_bytes_are_refused() {
        let encoded = encode_moments(&block(5, true), 0..5);
        assert!((0..encoded.len()).all(|length| decode_moments(&encoded[..length]).is_none()));
        assert!(decode_moments(&[&encoded[..], &[0]].concat()).is_none());
        // A list longer than memory, and a length that is no number.
        for length in [&[0xff; 9][..], &[0xff; 11]] {
            assert!(decode_moments(&[length, &[1; 64]].concat()).is_none());
            assert!(decode_replicates(&[&[1], length, &[1; 64]].concat()).is_none());
        }
    }

    #[test]
    fn whatever_is_decoded_postcard_decodes_alike() {
        // Any byte changed: the two agree about what it means, and about whether it means anything.
        let encoded = encode_moments(&block(3, true), 0..3);
        for at in 0..encoded.len() {
            for mask in [1, 0x80, 0xff] {
                let mut changed = encoded.clone();
                changed[at] ^= mask;
                let theirs = postcard::take_from_bytes::<MomentBlock>(&changed).ok();
                let theirs = theirs.and_then(|(block, rest)| rest.is_empty().then_some(block));
                assert_eq!(decode_moments(&changed).map(|b| bytes(&b)), theirs.map(|b| bytes(&b)), "{at}");
            }
        }
    }
}
