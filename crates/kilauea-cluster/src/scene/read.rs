//! What [`super::write`] wrote.

use bytemuck::AnyBitPattern;
use bytemuck::NoUninit;

use super::SceneBytesError;

/// Takes from the front.
pub(super) struct SceneReader<'a> {
    rest: &'a [u8],
}

impl<'a> SceneReader<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    /// Fails where something is left.
    pub(super) fn finish(self) -> Result<(), SceneBytesError> {
        match self.rest.len() {
            0 => Ok(()),
            n => Err(SceneBytesError::Rest(n)),
        }
    }

    pub(super) fn u8(&mut self) -> Result<u8, SceneBytesError> {
        self.take(1).map(|bytes| bytes[0])
    }

    pub(super) fn u32(&mut self) -> Result<u32, SceneBytesError> {
        self.number().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Result<u64, SceneBytesError> {
        self.number().map(u64::from_le_bytes)
    }

    /// A flag: 0 or 1.
    pub(super) fn flag(&mut self, what: &'static str) -> Result<bool, SceneBytesError> {
        match self.u8()? {
            0 => Ok(false),
            1 => Ok(true),
            value => Err(SceneBytesError::Value { what, value }),
        }
    }

    pub(super) fn array<T: AnyBitPattern + NoUninit>(&mut self) -> Result<Vec<T>, SceneBytesError> {
        let n_bytes = self.u64()?.saturating_mul(size_of::<T>() as u64);
        let bytes = self.take(n_bytes)?;
        Ok(bytemuck::pod_collect_to_vec(bytes))
    }

    pub(super) fn text(&mut self) -> Result<String, SceneBytesError> {
        Ok(String::from_utf8(self.array()?)?)
    }

    pub(super) fn optional_array<T: AnyBitPattern + NoUninit>(
        &mut self,
    ) -> Result<Option<Vec<T>>, SceneBytesError> {
        let is_there = self.flag("whether an array is there")?;
        is_there.then(|| self.array()).transpose()
    }

    /// A list. Memory grows with what has been read, not with the number of items promised.
    pub(super) fn list<T>(
        &mut self,
        mut read: impl FnMut(&mut Self) -> Result<T, SceneBytesError>,
    ) -> Result<Vec<T>, SceneBytesError> {
        let n_items = self.u64()?;
        let mut items = Vec::new();
        for _ in 0..n_items {
            items.push(read(self)?);
        }
        Ok(items)
    }

    fn number<const N: usize>(&mut self) -> Result<[u8; N], SceneBytesError> {
        let bytes = self.take(N as u64)?;
        Ok(*bytes.first_chunk().expect("as many were taken"))
    }

    fn take(&mut self, n_bytes: u64) -> Result<&'a [u8], SceneBytesError> {
        let cut = SceneBytesError::Cut {
            available: self.rest.len(),
            wanted: n_bytes,
        };
        let n = usize::try_from(n_bytes).unwrap_or(usize::MAX);
        let (taken, rest) = self.rest.split_at_checked(n).ok_or(cut)?;
        self.rest = rest;
        Ok(taken)
    }
}
