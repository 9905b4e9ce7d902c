//! What crosses between processes: frames of bytes with a header, and the messages in them.

mod codec;
mod error;
mod frame;
mod kind;
mod message;

pub use error::FrameError;
pub use frame::{Expected, Frame, HEADER_BYTES, Header, MAGIC, PROTOCOL};
pub use kind::FrameKind;
pub use message::{
    Challenge, Chunk, Failed, Finish, Heartbeat, Hello, Lease, LeaseStart, Manifest, MemberAddress,
    Members, Message, PassesOver, PathsLeft, PathsLent, PathsWanted, Ready, Refused, Report,
    SceneBytes, Seat, Start, UnitDone, UnitDropped, UnitRefused,
};
