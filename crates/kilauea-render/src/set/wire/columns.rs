//! Columns of numbers. One that is the same in all rows is sent once.

use kilauea_spot::{Wire, WireError};

/// Reads or writes columns of as many rows each.
pub(super) struct Columns {
    n_rows: usize,
}

const SAME: u8 = 0;
const EACH: u8 = 1;

impl Columns {
    pub(super) fn of(n_rows: usize) -> Self {
        Self { n_rows }
    }

    /// Writes a column of words, byte by byte of each: the first bytes of all, then the second, and
    /// so on. What packs bytes then finds the like next to each other (as blosc's shuffle).
    pub(super) fn put_words(&self, words: &[u32], bytes: &mut Vec<u8>) {
        debug_assert_eq!(words.len(), self.n_rows);
        let Some(&first) = words.first() else { return };
        if words.iter().all(|&word| word == first) {
            bytes.push(SAME);
            first.encode(bytes);
            return;
        }
        bytes.push(EACH);
        for plane in 0..4 {
            bytes.extend(words.iter().map(|word| word.to_le_bytes()[plane]));
        }
    }

    pub(super) fn take_words(&self, bytes: &mut &[u8]) -> Result<Vec<u32>, WireError> {
        let n = self.n_rows;
        if n == 0 {
            return Ok(Vec::new());
        }
        match u8::decode(bytes)? {
            SAME => Ok(vec![u32::decode(bytes)?; n]),
            EACH => {
                let (planes, rest) = bytes.split_at_checked(4 * n).ok_or(WireError::Short)?;
                *bytes = rest;
                let word = |i: usize| u32::from_le_bytes([0, 1, 2, 3].map(|p| planes[p * n + i]));
                Ok((0..n).map(word).collect())
            }
            other => Err(WireError::Variant(other)),
        }
    }

    pub(super) fn put_bytes(&self, values: &[u8], bytes: &mut Vec<u8>) {
        debug_assert_eq!(values.len(), self.n_rows);
        let Some(&first) = values.first() else { return };
        if values.iter().all(|&value| value == first) {
            bytes.extend([SAME, first]);
        } else {
            bytes.push(EACH);
            bytes.extend_from_slice(values);
        }
    }

    pub(super) fn take_bytes(&self, bytes: &mut &[u8]) -> Result<Vec<u8>, WireError> {
        let n = self.n_rows;
        if n == 0 {
            return Ok(Vec::new());
        }
        match u8::decode(bytes)? {
            SAME => Ok(vec![u8::decode(bytes)?; n]),
            EACH => {
                let (values, rest) = bytes.split_at_checked(n).ok_or(WireError::Short)?;
                *bytes = rest;
                Ok(values.to_vec())
            }
            other => Err(WireError::Variant(other)),
        }
    }

    /// Writes one bit for each row.
    pub(super) fn put_bits(&self, bits: impl Iterator<Item = bool>, bytes: &mut Vec<u8>) {
        let mut packed = vec![0_u8; self.n_rows.div_ceil(8)];
        for (i, _) in bits.enumerate().filter(|(_, is_set)| *is_set) {
            packed[i / 8] |= 1 << (i % 8);
        }
        bytes.extend(packed);
    }

    pub(super) fn take_bits(&self, bytes: &mut &[u8]) -> Result<Vec<bool>, WireError> {
        let n_bytes = self.n_rows.div_ceil(8);
        let (packed, rest) = bytes.split_at_checked(n_bytes).ok_or(WireError::Short)?;
        *bytes = rest;
        let bit = |i: usize| packed[i / 8] >> (i % 8) & 1 != 0;
        Ok((0..self.n_rows).map(bit).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_survive() {
        let words = [1, 0x1234_5678, u32::MAX, 7, 7];
        let same = [9; 5];
        let bits = [true, false, false, true, true];
        let columns = Columns::of(5);
        let mut bytes = Vec::new();
        columns.put_words(&words, &mut bytes);
        columns.put_words(&same, &mut bytes);
        columns.put_bytes(&[1, 2, 3, 4, 5], &mut bytes);
        columns.put_bytes(&[6; 5], &mut bytes);
        columns.put_bits(bits.into_iter(), &mut bytes);
        assert_eq!(bytes.len(), (1 + 20) + (1 + 4) + (1 + 5) + (1 + 1) + 1);
        let read = |mut bytes: &[u8]| {
            assert_eq!(columns.take_words(&mut bytes)?, words);
            assert_eq!(columns.take_words(&mut bytes)?, same);
            assert_eq!(columns.take_bytes(&mut bytes)?, [1, 2, 3, 4, 5]);
            assert_eq!(columns.take_bytes(&mut bytes)?, [6; 5]);
            assert_eq!(columns.take_bits(&mut bytes)?, bits);
            assert!(bytes.is_empty());
            Ok::<_, WireError>(())
        };
        read(&bytes).expect("they are whole");
        for end in 0..bytes.len() {
            assert_eq!(read(&bytes[..end]), Err(WireError::Short));
        }
        let unknown = columns.take_words(&mut &[2_u8; 40][..]);
        assert_eq!(unknown, Err(WireError::Variant(2)));
    }

    #[test]
    fn columns_of_nothing_are_nothing() {
        let columns = Columns::of(0);
        let mut bytes = Vec::new();
        columns.put_words(&[], &mut bytes);
        columns.put_bytes(&[], &mut bytes);
        assert!(bytes.is_empty());
        assert_eq!(columns.take_words(&mut &bytes[..]), Ok(Vec::new()));
    }
}
