//! Memory of few translations: rays scatter over large trees, and with pages of 4 KiB most of their
//! loads would wait for the page tables first.

/// Less than this is not worth the copy.
const LEAST_BYTES: usize = 8 << 20;

/// The same items in memory for which the system was asked to use huge pages, where it has any.
pub(super) fn moved_into<T: Copy>(items: Vec<T>) -> Vec<T> {
    if size_of_val(items.as_slice()) < LEAST_BYTES {
        return items;
    }
    let mut moved = Vec::with_capacity(items.len());
    advise(&mut moved);
    moved.extend_from_slice(&items);
    moved
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
    fn items_stay_as_they_are() {
        for n in [0, 10, LEAST_BYTES / 8 + 1] {
            let items: Vec<u64> = (0..n as u64).collect();
            assert_eq!(moved_into(items.clone()), items);
        }
    }
}
