//! Arrays in large pages of memory: a walk through a large hierarchy otherwise waits for the translation of addresses, too.
//!
//! Linux is advised, no more: where it has no large pages, or on an array smaller than one, nothing changes.

#![allow(unsafe_code, reason = "advice on memory is a system call on an address; see `advise`")]

use nix::sys::mman::{MmapAdvise, madvise};
use std::mem::MaybeUninit;
use std::ptr::NonNull;

/// A large page of x86-64 \[bytes\].
const LARGE: usize = 2 << 20;
/// A small one \[bytes\].
const SMALL: usize = 4096;
/// From here on the C library always asks Linux for memory of its own, which has no small pages yet \[bytes\]. What is not used of
/// it is nowhere.
const OWN: usize = 33 << 20;

/// The `items`, of which there are `count`.
pub(super) fn collect<T>(count: usize, items: impl Iterator<Item = T>) -> Vec<T> {
    let bytes = count * size_of::<T>();
    let capacity = if bytes < LARGE { count } else { count.max(OWN / size_of::<T>()) };
    let mut all = Vec::with_capacity(capacity);
    advise(all.spare_capacity_mut());
    all.extend(items);
    all
}

/// Asks for large pages below `memory`.
fn advise<T>(memory: &mut [MaybeUninit<T>]) {
    let skipped = memory.as_mut_ptr().cast::<u8>().align_offset(SMALL);
    let bytes = size_of_val(memory).saturating_sub(skipped) / SMALL * SMALL;
    if bytes < LARGE {
        return;
    }
    // SAFETY: whole pages of memory that is ours; the advice changes neither their content nor what may be done with them.
    let advised = unsafe {
        let start = NonNull::new_unchecked(memory.as_mut_ptr().cast::<u8>().add(skipped)).cast();
        madvise(start, bytes, MmapAdvise::MADV_HUGEPAGE)
    };
    // A kernel without large pages refuses, and all goes on with small ones.
    advised.unwrap_or(());
}

#[cfg(test)]
mod tests {
    use super::collect;

    #[test]
    fn content_is_that_of_the_items() {
        for count in [0, 1, 1000, 3_000_000] {
            let all = collect(count, 0..count as u64);
            assert!(all.len() == count && all.iter().enumerate().all(|(i, &x)| x == i as u64));
        }
    }
}
