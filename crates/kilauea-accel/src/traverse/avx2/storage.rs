//! Stacks of walks that are neither cleared nor checked.

use std::arch::x86_64::{
    _mm_loadl_epi64, _mm256_cvtepu8_epi32, _mm256_loadu_si256, _mm256_permutevar8x32_epi32,
    _mm256_storeu_si256,
};
use std::mem::MaybeUninit;

use crate::node::STACK_CAPACITY;
use crate::traverse::stack::{Entry, Links, Storage};

/// Storage that is neither cleared nor checked.
pub(crate) struct Unchecked([MaybeUninit<Entry>; STACK_CAPACITY]);

impl Storage for Unchecked {
    #[inline(always)]
    fn new() -> Self {
        Self([const { MaybeUninit::uninit() }; STACK_CAPACITY])
    }

    #[inline(always)]
    fn write(&mut self, index: usize, entry: Entry) {
        debug_assert!(index < STACK_CAPACITY);
        // SAFETY: builds bound the entries of every walk by the capacity.
        unsafe { self.0.get_unchecked_mut(index) }.write(entry);
    }

    #[inline(always)]
    fn read(&self, index: usize) -> Entry {
        debug_assert!(index < STACK_CAPACITY);
        // SAFETY: `Stack` reads below its length alone, where it has written before.
        unsafe { self.0.get_unchecked(index).assume_init() }
    }
}

/// Links that are neither cleared nor checked. Lanes are written eight at a time.
pub(crate) struct UncheckedLinks([MaybeUninit<u32>; STACK_CAPACITY + 8]);

impl Links for UncheckedLinks {
    #[inline(always)]
    fn new() -> Self {
        Self([const { MaybeUninit::uninit() }; STACK_CAPACITY + 8])
    }

    #[inline(always)]
    fn push_lanes(&mut self, len: usize, links: &[u32; 8], mask: u32) -> usize {
        debug_assert!(len <= STACK_CAPACITY);
        // SAFETY: the processor has AVX2, since only its kernel makes such a stack; builds bound
        // the entries of every walk by the capacity, and there is room for eight more.
        unsafe {
            let order = &raw const FIRST_LANES[(mask & 255) as usize];
            let order = _mm256_cvtepu8_epi32(_mm_loadl_epi64(order.cast()));
            let lanes = _mm256_loadu_si256(links.as_ptr().cast());
            let packed = _mm256_permutevar8x32_epi32(lanes, order);
            _mm256_storeu_si256(self.0.as_mut_ptr().add(len).cast(), packed);
        }
        len + mask.count_ones() as usize
    }

    #[inline(always)]
    fn read(&self, index: usize) -> u32 {
        debug_assert!(index < STACK_CAPACITY);
        // SAFETY: walks read below their length alone, where they have written before.
        unsafe { self.0.get_unchecked(index).assume_init() }
    }
}

/// By mask: the lanes in it, in order.
static FIRST_LANES: [[u8; 8]; 256] = {
    let mut lanes = [[0; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut n) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                lanes[mask][n] = lane as u8;
                n += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    lanes
};
