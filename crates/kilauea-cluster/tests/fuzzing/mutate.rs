//! Damages bytes in the ways that decoders have to survive.

use kilauea_math::hash::mix64;

/// Numbers at which lengths, counts and indices go wrong.
const EDGES: [u64; 10] = [
    0,
    1,
    0x7f,
    0xff,
    0x7fff,
    0xffff,
    0x7fff_ffff,
    0xffff_ffff,
    i64::MAX.cast_unsigned(),
    u64::MAX,
];
/// Inputs do not grow beyond this.
const MAX_BYTES: usize = 1 << 18;

/// Makes damaged copies; the same seed makes the same ones.
pub(crate) struct Mutator {
    state: u64,
}

impl Mutator {
    pub(crate) fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// A number below `n`.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        // SplitMix64 (Steele et al. 2014).
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mix64(self.state) % n.max(1) as u64) as usize
    }

    /// A copy of `bytes` with one to eight faults; `other` is another input to take pieces from.
    pub(crate) fn damage(&mut self, bytes: &[u8], other: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        for _ in 0..=self.below(8) {
            self.fault(&mut bytes, other);
        }
        bytes.truncate(MAX_BYTES);
        bytes
    }

    fn fault(&mut self, bytes: &mut Vec<u8>, other: &[u8]) {
        let n = bytes.len();
        let at = self.below(n);
        match self.below(9) {
            0 if n > 0 => bytes[at] ^= 1 << self.below(8),
            1 if n > 0 => bytes[at] = self.below(256) as u8,
            2 | 3 => self.put_number(bytes, at),
            4 => bytes.truncate(at),
            5 => {
                let piece = self.piece(&bytes.clone());
                bytes.splice(at..at, piece);
            }
            6 if n > 0 => {
                let end = at + self.below(64.min(n - at) + 1);
                bytes.drain(at..end);
            }
            7 => {
                let piece = self.piece(other);
                bytes.splice(at..at, piece);
            }
            // The front of one and the back of another.
            _ => {
                bytes.truncate(at);
                bytes.extend_from_slice(&other[self.below(other.len())..]);
            }
        }
    }

    /// Writes a number of 1, 2, 4 or 8 bytes that is an edge, close to one, or the length of the input.
    fn put_number(&mut self, bytes: &mut [u8], at: usize) {
        let width = 1 << self.below(4);
        let edge = match self.below(EDGES.len() + 1) {
            i if i < EDGES.len() => EDGES[i],
            _ => bytes.len() as u64,
        };
        let number = edge.wrapping_add(self.below(5) as u64).wrapping_sub(2);
        let room = bytes[at..].iter_mut().take(width);
        room.zip(number.to_le_bytes())
            .for_each(|(byte, new)| *byte = new);
    }

    fn piece(&mut self, of: &[u8]) -> Vec<u8> {
        let start = self.below(of.len());
        let rest = &of[start..];
        rest[..self.below(64.min(rest.len()) + 1)].to_vec()
    }
}
