use std::io;

use super::FrameKind;

/// Why bytes are no frame, or a frame no message.
#[derive(Debug, thiserror::Error)]
pub enum FrameError {
    /// Not from a program of ours.
    #[error("frame does not begin with the magic bytes")]
    Magic,
    /// Another protocol.
    #[error("frame is of protocol {0}")]
    Protocol(u16),
    /// Unknown kind.
    #[error("frame is of kind {0}, which there is not")]
    Kind(u8),
    /// Unknown flags.
    #[error("frame has flags {0:#04x}, which there are not")]
    Flags(u8),
    /// More bytes than such a frame may have.
    #[error("{kind:?} of {length} bytes, over the limit of {limit}")]
    TooLong {
        /// What it says it is.
        kind: FrameKind,
        /// Bytes of its body.
        length: u64,
        /// How many there may be.
        limit: u32,
    },
    /// Another session.
    #[error("frame is of session {0:016x}")]
    Session(u64),
    /// A frame is missing, or came twice.
    #[error("frame has number {found}, expected {expected}")]
    Sequence {
        /// Number expected.
        expected: u16,
        /// Number found.
        found: u16,
    },
    /// The bytes are not those that were sent.
    #[error("{0:?} does not match its checksum")]
    Checksum(FrameKind),
    /// A frame that has no place here.
    #[error("{found:?} where {expected} should come")]
    Unexpected {
        /// What there is.
        found: FrameKind,
        /// What should be there, in words.
        expected: &'static str,
    },
    /// The body says something that cannot be read.
    #[error("{kind:?} cannot be read: {reason}")]
    Body {
        /// What it says it is.
        kind: FrameKind,
        /// What is wrong.
        reason: String,
    },
    /// The other side has closed the link, between two frames.
    #[error("the link was closed")]
    Closed,
    /// The bytes cannot be read or written, or end within a frame.
    #[error(transparent)]
    Io(#[from] io::Error),
}
