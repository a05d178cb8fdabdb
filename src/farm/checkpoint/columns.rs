//! Sections of numbers, a whole column at a time.
//!
//! Moments are columns of eight bytes a number, packed. Batch scores stand in postcard's form: a list of f64 is its length
//! as a varint and eight little-endian bytes for each entry. Postcard's own serializer goes through them byte by byte; these
//! functions give and take the same bytes (a test compares them) at the speed of memory, which is what merging and
//! writing large sets need. They know columns, not what stands in them.

use super::packed::{pack, unpack};
use crate::tally::{MomentBlock, Replicates};
use std::ops::Range;

/// The bins `range` of `bins`: the columns end to end, eight little-endian bytes for each number.
pub fn to_bytes(bins: &MomentBlock, range: Range<usize>) -> Vec<u8> {
    let MomentBlock { mean, m2, direct, peak, caustic, existed, colour } = bins;
    let mut to = Vec::with_capacity(bytes_of(range.len(), !colour.is_empty()));
    for column in [mean, m2, direct, peak, caustic] {
        put_numbers(&mut to, &column[range.clone()]);
    }
    existed[range.clone()].iter().for_each(|count| to.extend(count.to_le_bytes()));
    for channel in 0..if colour.is_empty() { 0 } else { 3 } {
        colour[range.clone()].iter().for_each(|c| to.extend(c[channel].to_le_bytes()));
    }
    to
}

/// The block of `bins` bins in `bytes`; None where they are anything else.
pub fn from_bytes(bytes: &[u8], bins: usize, colour: bool) -> Option<MomentBlock> {
    if bytes.len() != bytes_of(bins, colour) {
        return None;
    }
    let mut columns = bytes.chunks_exact((8 * bins).max(1));
    let mut words = || columns.next().unwrap_or_default().as_chunks().0.iter();
    let mut numbers = || words().map(|word| f64::from_le_bytes(*word)).collect::<Vec<f64>>();
    let [mean, m2, direct, peak, caustic] = std::array::from_fn(|_| numbers());
    let existed = words().map(|word| u64::from_le_bytes(*word)).collect();
    let mut block = MomentBlock { mean, m2, direct, peak, caustic, existed, colour: Vec::new() };
    block.colour.resize(if colour { bins } else { 0 }, [0.0; 3]);
    for channel in 0..if colour { 3 } else { 0 } {
        block.colour.iter_mut().zip(words()).for_each(|(c, word)| c[channel] = f64::from_le_bytes(*word));
    }
    Some(block)
}

/// Bytes of a block of `bins` bins.
fn bytes_of(bins: usize, colour: bool) -> usize {
    8 * bins * if colour { 9 } else { 6 }
}

/// The bins `range` of `bins`, packed.
pub fn encode_moments(bins: &MomentBlock, range: Range<usize>) -> Vec<u8> {
    pack(&to_bytes(bins, range.clone()), range.len())
}

/// The block of `bins` bins in `bytes`; None where they are anything else.
pub(super) fn decode_moments(bytes: &[u8], bins: usize, colour: bool) -> Option<MomentBlock> {
    from_bytes(&unpack(bytes, bins, bytes_of(bins, colour))?, bins, colour)
}

/// `scores`, as postcard would write them.
pub fn encode_replicates(scores: &Replicates) -> Vec<u8> {
    let Replicates { bins, value, direct, peak, caustic, existed } = scores;
    let mut to = Vec::with_capacity(8 * (value.len() + direct.len()) + (2 * 8 + 2) * peak.len() + 64);
    put_count(&mut to, *bins);
    for column in [value, direct, peak, caustic] {
        put_count(&mut to, column.len() as u64);
        put_numbers(&mut to, column);
    }
    put_count(&mut to, existed.len() as u64);
    existed.iter().for_each(|&count| put_count(&mut to, count));
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

fn put_numbers(to: &mut Vec<u8>, numbers: &[f64]) {
    let start = to.len();
    to.resize(start + 8 * numbers.len(), 0);
    to[start..].as_chunks_mut().0.iter_mut().zip(numbers).for_each(|(bytes, x)| *bytes = x.to_le_bytes());
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

    fn numbers(&mut self) -> Option<Vec<f64>> {
        let length = usize::try_from(self.count()?).ok()?.checked_mul(8)?;
        let (numbers, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(numbers.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect())
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

    fn replicates(bins: usize) -> Replicates {
        let MomentBlock { mean, m2, peak, caustic, existed, .. } = block(bins, false);
        Replicates { bins: bins as u64, value: mean, direct: m2, peak, caustic, existed }
    }

    #[test]
    fn moments_come_back_bit_for_bit() {
        for (bins, colour) in [(0, false), (1, true), (127, false), (4096, true)] {
            let block = block(bins, colour);
            let encoded = encode_moments(&block, 0..bins);
            assert_eq!(bytes(&decode_moments(&encoded, bins, colour).unwrap()), bytes(&block), "{bins}");
            let part = bins / 3..bins;
            let decoded = decode_moments(&encode_moments(&block, part.clone()), part.len(), colour).unwrap();
            assert_eq!(bytes(&decoded), bytes(&block.slice(part)), "{bins}");
            // Of another shape.
            assert!(decode_moments(&encoded, bins + 1, colour).is_none());
            assert!(bins == 0 || decode_moments(&encoded, bins, !colour).is_none());
        }
    }

    #[test]
    fn the_bytes_of_batch_scores_are_those_of_postcard() {
        for bins in [0, 1, 127, 128, 300] {
            let scores = replicates(bins);
            let encoded = encode_replicates(&scores);
            assert_eq!(encoded, bytes(&scores), "{bins}");
            assert_eq!(bytes(&decode_replicates(&encoded).unwrap()), encoded, "{bins}");
        }
    }

    #[test]
    fn cut_lengthened_and_impossible_bytes_are_refused() {
        let encoded = encode_replicates(&replicates(5));
        assert!((0..encoded.len()).all(|length| decode_replicates(&encoded[..length]).is_none()));
        assert!(decode_replicates(&[&encoded[..], &[0]].concat()).is_none());
        // A list longer than memory, and a length that is no number.
        for length in [&[0xff; 9][..], &[0xff; 11]] {
            assert!(decode_replicates(&[&[1], length, &[1; 64]].concat()).is_none());
        }
    }

    #[test]
    fn whatever_is_decoded_postcard_decodes_alike() {
        // Any byte changed: the two agree about what it means, and about whether it means anything.
        let encoded = encode_replicates(&replicates(3));
        for at in 0..encoded.len() {
            for mask in [1, 0x80, 0xff] {
                let mut changed = encoded.clone();
                changed[at] ^= mask;
                let theirs = postcard::take_from_bytes::<Replicates>(&changed).ok();
                let theirs = theirs.and_then(|(scores, rest)| rest.is_empty().then_some(scores));
                assert_eq!(decode_replicates(&changed).map(|s| bytes(&s)), theirs.map(|s| bytes(&s)), "{at}");
            }
        }
    }
}
