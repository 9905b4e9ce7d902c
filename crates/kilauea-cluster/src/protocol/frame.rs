//! A frame: 32 bytes of header, then its body.
//!
//! | bytes | field | |
//! |---|---|---|
//! | 0..4 | magic | `KIL1` |
//! | 4..6 | protocol | u16 |
//! | 6 | kind | u8 |
//! | 7 | flags | bit 0: last of its kind |
//! | 8..12 | length of the body | u32 |
//! | 12..16 | CRC-32C | of the header with zeros here, then the body |
//! | 16..24 | session | u64 |
//! | 24..28 | epoch | u32 |
//! | 28..30 | number of the batch of rays | u16 |
//! | 30..32 | number of the frame on its link | u16, wraps |
//!
//! Numbers are little-endian.

use crc32c::{crc32c, crc32c_append};

use super::{FrameError, FrameKind};

/// First bytes of every frame.
pub const MAGIC: [u8; 4] = *b"KIL1";
/// The protocol that this program speaks.
pub const PROTOCOL: u16 = 1;
/// Bytes of a header.
pub const HEADER_BYTES: usize = 32;
const FLAG_LAST: u8 = 1;

/// What is sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// What the body is.
    pub kind: FrameKind,
    /// Whether it ends what frames of its kind say together.
    pub is_last: bool,
    /// In which life of a worker it was sent: frames of earlier lives are dropped.
    pub epoch: u32,
    /// Number of the batch of rays that it asks or answers; 0 where there is none.
    pub batch: u16,
    /// The body.
    pub body: Vec<u8>,
}

/// What the reader of a header knows beforehand.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    /// The session; none where it does not matter.
    pub session: Option<u64>,
    /// Number of the frame on its link.
    pub number: u16,
    /// Most bytes of a body, whatever its kind.
    pub max_body_bytes: u32,
}

/// A header that has been checked, apart from its checksum.
#[derive(Clone, Debug)]
pub struct Header {
    kind: FrameKind,
    is_last: bool,
    n_body_bytes: u32,
    checksum: u32,
    /// Of the header alone.
    checksum_so_far: u32,
    epoch: u32,
    batch: u16,
}

impl Frame {
    /// A frame that stands for itself, of no batch.
    pub fn new(kind: FrameKind, epoch: u32, body: Vec<u8>) -> Self {
        Self {
            kind,
            is_last: true,
            epoch,
            batch: 0,
            body,
        }
    }

    /// The header to send before the body.
    pub fn header(&self, session: u64, number: u16) -> Result<[u8; HEADER_BYTES], FrameError> {
        let limit = self.kind.limit();
        let length = u32::try_from(self.body.len()).unwrap_or(u32::MAX);
        if length > limit {
            return Err(FrameError::TooLong {
                kind: self.kind,
                length: self.body.len() as u64,
                limit,
            });
        }
        let mut header = [0; HEADER_BYTES];
        header[0..4].copy_from_slice(&MAGIC);
        header[4..6].copy_from_slice(&PROTOCOL.to_le_bytes());
        header[6] = self.kind as u8;
        header[7] = if self.is_last { FLAG_LAST } else { 0 };
        header[8..12].copy_from_slice(&length.to_le_bytes());
        header[16..24].copy_from_slice(&session.to_le_bytes());
        header[24..28].copy_from_slice(&self.epoch.to_le_bytes());
        header[28..30].copy_from_slice(&self.batch.to_le_bytes());
        header[30..32].copy_from_slice(&number.to_le_bytes());
        let checksum = crc32c_append(crc32c(&header), &self.body);
        header[12..16].copy_from_slice(&checksum.to_le_bytes());
        Ok(header)
    }
}

impl Header {
    /// Reads a header and checks it before anything is allocated for the body.
    pub fn parse(bytes: &[u8; HEADER_BYTES], expected: &Expected) -> Result<Self, FrameError> {
        let u16_at = |i: usize| u16::from_le_bytes([bytes[i], bytes[i + 1]]);
        let u32_at = |i: usize| u32::from(u16_at(i)) | (u32::from(u16_at(i + 2)) << 16);
        let session = u64::from(u32_at(16)) | (u64::from(u32_at(20)) << 32);
        if bytes[0..4] != MAGIC {
            return Err(FrameError::Magic);
        }
        if u16_at(4) != PROTOCOL {
            return Err(FrameError::Protocol(u16_at(4)));
        }
        let kind = FrameKind::try_from(bytes[6])?;
        if bytes[7] & !FLAG_LAST != 0 {
            return Err(FrameError::Flags(bytes[7]));
        }
        let n_body_bytes = u32_at(8);
        let limit = kind.limit().min(expected.max_body_bytes);
        if n_body_bytes > limit {
            return Err(FrameError::TooLong {
                kind,
                length: n_body_bytes.into(),
                limit,
            });
        }
        if expected.session.is_some_and(|expected| expected != session) {
            return Err(FrameError::Session(session));
        }
        if u16_at(30) != expected.number {
            return Err(FrameError::Sequence {
                expected: expected.number,
                found: u16_at(30),
            });
        }
        let mut unsummed = *bytes;
        unsummed[12..16].fill(0);
        Ok(Self {
            kind,
            is_last: bytes[7] & FLAG_LAST != 0,
            n_body_bytes,
            checksum: u32_at(12),
            checksum_so_far: crc32c(&unsummed),
            epoch: u32_at(24),
            batch: u16_at(28),
        })
    }

    /// Bytes of the body that follows.
    pub fn n_body_bytes(&self) -> usize {
        self.n_body_bytes as usize
    }

    /// The frame with that body, if it is the one that was sent.
    pub fn with_body(self, body: Vec<u8>) -> Result<Frame, FrameError> {
        if crc32c_append(self.checksum_so_far, &body) != self.checksum {
            return Err(FrameError::Checksum(self.kind));
        }
        Ok(Frame {
            kind: self.kind,
            is_last: self.is_last,
            epoch: self.epoch,
            batch: self.batch,
            body,
        })
    }
}
