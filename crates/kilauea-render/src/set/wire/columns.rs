//! Columns of numbers. One that is the same in all rows is sent once, and the others in the order that
//! what packs them likes, or as they lie in memory where nothing does.

use kilauea_spot::{Wire, WireError};

use super::Packing;

/// Reads or writes columns of as many rows each.
pub(super) struct Columns {
    n_rows: usize,
    /// What is done to all of the columns afterwards.
    packing: Packing,
}

const SAME: u8 = 0;
const EACH: u8 = 1;
/// Words byte by byte: what packs bytes finds the like next to each other (as blosc's shuffle).
const SHUFFLED: u8 = 2;

impl Columns {
    pub(super) fn of(n_rows: usize) -> Self {
        Self {
            n_rows,
            packing: Packing::Plain,
        }
    }

    /// Columns that are written to be packed.
    pub(super) fn packed_by(self, packing: Packing) -> Self {
        Self { packing, ..self }
    }

    /// Writes a column of words. To be packed, the first bytes of all come first, then the second, and
    /// so on.
    pub(super) fn put_words(&self, words: impl Iterator<Item = u32> + Clone, bytes: &mut Vec<u8>) {
        let Some(first) = words.clone().next() else {
            return;
        };
        if words.clone().all(|word| word == first) {
            bytes.push(SAME);
            first.encode(bytes);
            return;
        }
        if self.packing == Packing::Lz4 {
            bytes.push(SHUFFLED);
            for plane in 0..4 {
                bytes.extend(words.clone().map(|word| word.to_le_bytes()[plane]));
            }
            return;
        }
        bytes.push(EACH);
        let begin = bytes.len();
        bytes.resize(begin + 4 * self.n_rows, 0);
        for (at, word) in bytes[begin..].chunks_exact_mut(4).zip(words) {
            at.copy_from_slice(&word.to_le_bytes());
        }
    }

    pub(super) fn take_words(&self, bytes: &mut &[u8]) -> Result<Vec<u32>, WireError> {
        let n = self.n_rows;
        if n == 0 {
            return Ok(Vec::new());
        }
        match u8::decode(bytes)? {
            SAME => Ok(vec![u32::decode(bytes)?; n]),
            form @ (EACH | SHUFFLED) => {
                let (words, rest) = bytes.split_at_checked(4 * n).ok_or(WireError::Short)?;
                *bytes = rest;
                if form == SHUFFLED {
                    let word = |i| u32::from_le_bytes([0, 1, 2, 3].map(|p| words[p * n + i]));
                    return Ok((0..n).map(word).collect());
                }
                let (words, _) = words.as_chunks();
                Ok(words.iter().map(|word| u32::from_le_bytes(*word)).collect())
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
        check_columns(Packing::Plain);
        check_columns(Packing::Lz4);
    }

    fn check_columns(packing: Packing) {
        let words = [1, 0x1234_5678, u32::MAX, 7, 7];
        let same = [9; 5];
        let bits = [true, false, false, true, true];
        let columns = Columns::of(5).packed_by(packing);
        let mut bytes = Vec::new();
        columns.put_words(words.into_iter(), &mut bytes);
        columns.put_words(same.into_iter(), &mut bytes);
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
        let unknown = columns.take_words(&mut &[3_u8; 40][..]);
        assert_eq!(unknown, Err(WireError::Variant(3)));
    }

    #[test]
    fn columns_of_nothing_are_nothing() {
        let columns = Columns::of(0);
        let mut bytes = Vec::new();
        columns.put_words([].into_iter(), &mut bytes);
        columns.put_bytes(&[], &mut bytes);
        assert!(bytes.is_empty());
        assert_eq!(columns.take_words(&mut &bytes[..]), Ok(Vec::new()));
    }
}
