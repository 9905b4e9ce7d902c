use crate::node::STACK_CAPACITY;

/// A link to visit with the distance at which the ray enters it: the distance's bits are the high
/// half (ordered as integers, since no distance is negative), so equal distances go by link.
pub(crate) type Entry = u64;

#[inline(always)]
pub(crate) fn entry(link: u32, t: f32) -> Entry {
    (t.to_bits() as u64) << 32 | link as u64
}

#[inline(always)]
pub(crate) fn link(entry: Entry) -> u32 {
    entry as u32
}

#[inline(always)]
pub(crate) fn distance(entry: Entry) -> f32 {
    f32::from_bits((entry >> 32) as u32)
}

/// Room for [`STACK_CAPACITY`] entries; builds see to it that no walk needs more.
pub(crate) trait Storage {
    fn new() -> Self;
    /// Writes an entry below the capacity.
    fn write(&mut self, index: usize, entry: Entry);
    /// Reads an entry that was written.
    fn read(&self, index: usize) -> Entry;
}

/// Nodes still to visit. Its length is apart from the storage, so that it can stay in a register.
pub(crate) struct Stack<'a, S> {
    storage: &'a mut S,
    len: usize,
}

impl<'a, S: Storage> Stack<'a, S> {
    #[inline(always)]
    pub(crate) fn new(storage: &'a mut S) -> Self {
        Self { storage, len: 0 }
    }

    #[inline(always)]
    pub(crate) fn push(&mut self, entry: Entry) {
        self.storage.write(self.len, entry);
        self.len += 1;
    }

    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Option<Entry> {
        if self.len == 0 {
            return None;
        }
        self.len -= 1;
        Some(self.storage.read(self.len))
    }

    /// Pops an entry no further than `limit` and drops those above it.
    #[inline(always)]
    pub(crate) fn pop_within(&mut self, limit: f32) -> Option<Entry> {
        loop {
            let next = self.pop()?;
            if distance(next) <= limit {
                return Some(next);
            }
        }
    }

    /// Puts the last `n` entries in order, the nearest last (insertion sort: they are few).
    #[inline(always)]
    pub(crate) fn sort_top(&mut self, n: usize) {
        let first = self.len - n;
        for sorted in first + 1..self.len {
            let new = self.storage.read(sorted);
            let mut i = sorted;
            while i > first && self.storage.read(i - 1) < new {
                self.storage.write(i, self.storage.read(i - 1));
                i -= 1;
            }
            self.storage.write(i, new);
        }
    }
}

impl Storage for [Entry; STACK_CAPACITY] {
    fn new() -> Self {
        [0; STACK_CAPACITY]
    }

    #[inline(always)]
    fn write(&mut self, index: usize, entry: Entry) {
        self[index] = entry;
    }

    #[inline(always)]
    fn read(&self, index: usize) -> Entry {
        self[index]
    }
}

/// Links still to visit in no order, with room for [`STACK_CAPACITY`].
pub(crate) trait Links {
    fn new() -> Self;
    /// Writes the links of the lanes in `mask` from `len` on and gives how many there are then.
    fn push_lanes(&mut self, len: usize, links: &[u32; 8], mask: u32) -> usize;
    /// Reads a link that was written.
    fn read(&self, index: usize) -> u32;
}

impl Links for [u32; STACK_CAPACITY] {
    fn new() -> Self {
        [0; STACK_CAPACITY]
    }

    fn push_lanes(&mut self, mut len: usize, links: &[u32; 8], mask: u32) -> usize {
        for (_, link) in links
            .iter()
            .enumerate()
            .filter(|(lane, _)| mask >> lane & 1 != 0)
        {
            self[len] = *link;
            len += 1;
        }
        len
    }

    fn read(&self, index: usize) -> u32 {
        self[index]
    }
}
