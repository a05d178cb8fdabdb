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
    for (from, to) in columns.chunks_exact(WIDTH * entries.max(1)).zip(planes.chunks_exact_mut(WIDTH * entries.max(1)))
    {
        for (i, number) in from.as_chunks::<WIDTH>().0.iter().enumerate() {
            number.iter().enumerate().for_each(|(plane, byte)| to[plane * entries + i] = *byte);
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
    for (from, to) in planes.chunks_exact(WIDTH * entries.max(1)).zip(columns.chunks_exact_mut(WIDTH * entries.max(1)))
    {
        for (i, number) in to.as_chunks_mut::<WIDTH>().0.iter_mut().enumerate() {
            number.iter_mut().enumerate().for_each(|(plane, byte)| *byte = from[plane * entries + i]);
        }
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
