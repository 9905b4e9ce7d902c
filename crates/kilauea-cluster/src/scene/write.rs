//! Numbers, arrays and lists, one after the other.

use std::ops::Range;

use bytemuck::NoUninit;

/// Appends.
pub(super) struct SceneWriter {
    bytes: Vec<u8>,
    /// Where chunks are, in the order in which they were written.
    chunks: Vec<Range<usize>>,
}

impl SceneWriter {
    pub(super) fn with_capacity(n_bytes: usize) -> Self {
        Self {
            bytes: Vec::with_capacity(n_bytes),
            chunks: Vec::new(),
        }
    }

    /// All bytes, and where chunks are in them.
    pub(super) fn finish(self) -> (Vec<u8>, Vec<Range<usize>>) {
        (self.bytes, self.chunks)
    }

    /// Notes where a chunk is.
    pub(super) fn chunk<T>(&mut self, chunk: &T, write: impl FnOnce(&mut Self, &T)) {
        let start = self.bytes.len();
        write(self, chunk);
        self.chunks.push(start..self.bytes.len());
    }

    pub(super) fn u8(&mut self, value: u8) {
        self.bytes.push(value);
    }

    pub(super) fn u32(&mut self, value: u32) {
        self.bytes.extend(value.to_le_bytes());
    }

    pub(super) fn u64(&mut self, value: u64) {
        self.bytes.extend(value.to_le_bytes());
    }

    /// How many values, then the values.
    pub(super) fn array<T: NoUninit>(&mut self, values: &[T]) {
        self.u64(values.len() as u64);
        self.bytes.extend_from_slice(bytemuck::cast_slice(values));
    }

    pub(super) fn text(&mut self, text: &str) {
        self.array(text.as_bytes());
    }

    pub(super) fn optional_array<T: NoUninit>(&mut self, values: Option<&[T]>) {
        self.u8(values.is_some().into());
        if let Some(values) = values {
            self.array(values);
        }
    }

    /// How many items, then the items.
    pub(super) fn list<T>(&mut self, items: &[T], mut write: impl FnMut(&mut Self, &T)) {
        self.u64(items.len() as u64);
        for item in items {
            write(self, item);
        }
    }
}
