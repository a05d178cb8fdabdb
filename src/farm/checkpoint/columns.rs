//! Sections of numbers, a whole column at a time.
//!
//! Moments and batch scores are columns of eight bytes a number, packed. Postcard's serializer goes through numbers byte by byte;
//! these functions give and take them at the speed of memory, which is what merging and writing large sets need. They
//! know columns, not what stands in them.

use super::packed::{pack, unpack};
use crate::tally::MomentBlock;
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

/// Scores and their direct parts, equally many, packed.
pub fn encode_scores(value: &[f64], direct: &[f64]) -> Vec<u8> {
    let mut columns = Vec::with_capacity(2 * 8 * value.len());
    put_numbers(&mut columns, value);
    put_numbers(&mut columns, direct);
    pack(&columns, value.len())
}

/// As many scores and direct parts as `entries` in `bytes`; None where they are anything else.
pub(super) fn decode_scores(bytes: &[u8], entries: usize) -> Option<[Vec<f64>; 2]> {
    let columns = unpack(bytes, entries, 2 * 8 * entries)?;
    let (value, direct) = columns.split_at(8 * entries);
    Some([value, direct].map(|column| column.as_chunks().0.iter().map(|word| f64::from_le_bytes(*word)).collect()))
}

fn put_numbers(to: &mut Vec<u8>, numbers: &[f64]) {
    let start = to.len();
    to.resize(start + 8 * numbers.len(), 0);
    to[start..].as_chunks_mut().0.iter_mut().zip(numbers).for_each(|(bytes, x)| *bytes = x.to_le_bytes());
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
    fn batch_scores_come_back_bit_for_bit() {
        for entries in [0, 1, 35, 5000] {
            let MomentBlock { mean, m2, .. } = block(entries, false);
            let encoded = encode_scores(&mean, &m2);
            let decoded = decode_scores(&encoded, entries).unwrap();
            assert_eq!(bytes(&decoded), bytes(&[mean, m2]), "{entries}");
            // Of another shape.
            assert!(decode_scores(&encoded, entries + 1).is_none());
            assert!(entries == 0 || decode_scores(&encoded, entries - 1).is_none());
        }
    }
}
