//! Blocks of numbers, packed without loss: what a map takes on the disk.
//!
//! The bytes of each column are put in another order, first the lowest byte of every number, then the next one, up to the
//! sign and exponent: neighbours in a picture are alike in these, and LZ4 finds it. The size unpacked is always known from
//! the plan, so a hostile file cannot ask for more.

/// Bytes of a number.
const WIDTH: usize = 8;

/// `columns`, each of `entries` numbers of eight bytes, packed.
pub(super) fn pack(columns: &[u8], entries: usize) -> Vec<u8> {
    let mut planes = vec![0; columns.len()];
    let column = WIDTH * entries.max(1);
    let mut words = vec![0; entries];
    for (from, to) in columns.chunks_exact(column).zip(planes.chunks_exact_mut(column)) {
        words.iter_mut().zip(from.as_chunks().0).for_each(|(word, bytes)| *word = u64::from_le_bytes(*bytes));
        // Plane by plane, so that the compiler takes many numbers at a time.
        for (plane, to) in to.chunks_exact_mut(entries).enumerate() {
            to.iter_mut().zip(&words).for_each(|(byte, word)| *byte = (word >> (8 * plane)) as u8);
        }
    }
    lz4_flex::block::compress(&planes)
}

/// The columns of `entries` numbers in `packed`, `length` bytes together; None where they are anything else.
pub(super) fn unpack(packed: &[u8], entries: usize, length: usize) -> Option<Vec<u8>> {
    let mut planes = vec![0; length];
    let found = lz4_flex::block::decompress_into(packed, &mut planes).ok()?;
    if found != length {
        return None;
    }
    let mut columns = vec![0; length];
    let column = WIDTH * entries.max(1);
    let mut words = vec![0; entries];
    for (from, to) in planes.chunks_exact(column).zip(columns.chunks_exact_mut(column)) {
        words.fill(0);
        for (plane, from) in from.chunks_exact(entries).enumerate() {
            words.iter_mut().zip(from).for_each(|(word, byte)| *word |= u64::from(*byte) << (8 * plane));
        }
        to.as_chunks_mut().0.iter_mut().zip(&words).for_each(|(bytes, word)| *bytes = word.to_le_bytes());
    }
    Some(columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_packed_is_unpacked() {
        for entries in [0, 1, 7, 4096] {
            let numbers = (0..2 * entries).map(|i| (i as f64).sqrt());
            let bytes: Vec<u8> = numbers.flat_map(f64::to_le_bytes).collect();
            let packed = pack(&bytes, entries);
            assert_eq!(unpack(&packed, entries, bytes.len()), Some(bytes.clone()), "{entries}");
            // Another length is another block.
            assert_eq!(unpack(&packed, entries, bytes.len() + WIDTH), None);
            assert!(entries == 0 || unpack(&packed, entries, bytes.len() - WIDTH).is_none());
        }
        let zeros = vec![0; 8 * 4096];
        assert!(pack(&zeros, 4096).len() < 200);
    }

    #[test]
    fn changed_bytes_never_panic() {
        let bytes: Vec<u8> = (0..600).map(f64::from).flat_map(f64::to_le_bytes).collect();
        let packed = pack(&bytes, 600);
        for at in 0..packed.len() {
            for mask in [1, 0x80, 0xff] {
                let mut changed = packed.clone();
                changed[at] ^= mask;
                assert!(unpack(&changed, 600, bytes.len()).is_none_or(|b| b.len() == bytes.len()));
            }
        }
    }
}
