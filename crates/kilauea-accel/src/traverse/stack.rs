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

/// A stack of at most [`STACK_CAPACITY`] entries; builds see to it that no walk needs more.
pub(crate) trait Stack {
    fn new() -> Self;
    fn push(&mut self, entry: Entry);
    fn pop(&mut self) -> Option<Entry>;
    /// The last `n` entries.
    fn top(&mut self, n: usize) -> &mut [Entry];
}

/// A stack without unsafe code.
pub(crate) struct CheckedStack {
    entries: [Entry; STACK_CAPACITY],
    len: usize,
}

impl Stack for CheckedStack {
    fn new() -> Self {
        Self {
            entries: [0; STACK_CAPACITY],
            len: 0,
        }
    }

    #[inline(always)]
    fn push(&mut self, entry: Entry) {
        self.entries[self.len] = entry;
        self.len += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<Entry> {
        self.len = self.len.checked_sub(1)?;
        Some(self.entries[self.len])
    }

    #[inline(always)]
    fn top(&mut self, n: usize) -> &mut [Entry] {
        &mut self.entries[self.len - n..self.len]
    }
}
