//! Memory of few translations: rays scatter over large trees, and with pages of 4 KiB most of their
//! loads would wait for the page tables first.

use rayon::prelude::*;

/// Less than this is not worth the call.
const LEAST_BYTES: usize = 8 << 20;

/// The items in memory for which the system was asked to use huge pages, where it has any and there
/// are many items. Pages are touched first by the threads that write them.
pub(super) fn collected<T: Send>(items: impl IndexedParallelIterator<Item = T>) -> Vec<T> {
    let mut room = Vec::with_capacity(items.len());
    if room.capacity() * size_of::<T>() >= LEAST_BYTES {
        advise(&mut room);
    }
    items.collect_into_vec(&mut room);
    room
}

/// Asks for huge pages for the room of a vector that nothing was written into yet.
#[cfg(target_os = "linux")]
#[allow(unsafe_code, reason = "a system call")]
fn advise<T>(room: &mut Vec<T>) {
    const PAGE: usize = 4096;
    let start = room.as_mut_ptr() as usize;
    let end = start + room.capacity() * size_of::<T>();
    let first = start.next_multiple_of(PAGE);
    let length = (end / PAGE * PAGE).saturating_sub(first);
    // SAFETY: the pages lie within one live allocation, and the advice changes no contents. If it is
    // refused, all works as before.
    unsafe { libc::madvise(first as *mut libc::c_void, length, libc::MADV_HUGEPAGE) };
}

#[cfg(not(target_os = "linux"))]
fn advise<T>(_room: &mut Vec<T>) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_stay_in_order() {
        for n in [0, 10, LEAST_BYTES / 8 + 1] {
            let items = collected((0..n).into_par_iter().map(|i| i as u64));
            assert!(items.into_iter().eq(0..n as u64));
        }
    }
}
