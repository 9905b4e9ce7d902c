//! Kinds of frames, and how long each may be.

use super::FrameError;

const KIB: u32 = 1 << 10;
const MIB: u32 = 1 << 20;
/// Before anyone has proved anything.
const HANDSHAKE_BYTES: u32 = KIB;
const CONTROL_BYTES: u32 = 64 * KIB;
const DATA_BYTES: u32 = 4 * MIB;
const SCENE_BYTES: u32 = 64 * MIB;

/// Declares the kinds once: with their numbers and their limits.
macro_rules! frame_kinds {
    ($($(#[$doc:meta])* $kind:ident = $number:literal, $limit:ident;)+) => {
        /// What a frame holds.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(u8)]
        pub enum FrameKind {
            $($(#[$doc])* $kind = $number,)+
        }

        impl FrameKind {
            /// Every kind.
            pub const ALL: &[Self] = &[$(Self::$kind),+];

            /// Most bytes of the body.
            pub fn limit(self) -> u32 {
                match self {
                    $(Self::$kind => $limit,)+
                }
            }
        }
    };
}

frame_kinds! {
    /// Console to worker, first of all: prove that you know the token.
    Challenge = 1, HANDSHAKE_BYTES;
    /// Who one is, and the proof; worker to console, then console to worker.
    Hello = 2, HANDSHAKE_BYTES;
    /// Console to worker: go away, and why.
    Refused = 3, HANDSHAKE_BYTES;
    /// Either way, every 250 ms.
    Heartbeat = 4, CONTROL_BYTES;
    /// Console to worker: the settings, and what scene follows.
    Start = 5, CONTROL_BYTES;
    /// Console to worker: a piece of the scene.
    SceneBytes = 6, SCENE_BYTES;
    /// Worker to console: the scene is prepared.
    Ready = 7, CONTROL_BYTES;
    /// Console to worker: render this unit.
    Lease = 8, DATA_BYTES;
    /// Console to worker: nobody will ask for earlier passes any more.
    PassesOver = 9, CONTROL_BYTES;
    /// Worker to console: what a unit came to.
    UnitDone = 10, DATA_BYTES;
    /// Worker to console: a unit cannot be rendered.
    UnitRefused = 11, CONTROL_BYTES;
    /// Console to worker: there are no more units.
    Finish = 12, CONTROL_BYTES;
    /// Worker to console: statistics, after the last unit.
    Report = 13, DATA_BYTES;
    /// Worker to console: the frame cannot be rendered.
    Failed = 14, CONTROL_BYTES;
    /// First frame of a journal.
    Manifest = 15, CONTROL_BYTES;
    /// Between workers of a set: rays to trace.
    Rays = 16, DATA_BYTES;
    /// Between workers of a set: what rays met.
    Hits = 17, DATA_BYTES;
    /// Console to worker: who is in its set.
    Members = 18, CONTROL_BYTES;
    /// Console to worker: a chunk of its part of the scene, or a piece of one.
    Chunk = 19, SCENE_BYTES;
    /// Worker to console: in a pass over paths that all workers need.
    PathsWanted = 20, CONTROL_BYTES;
    /// Console to worker: follow these paths.
    PathsLent = 21, CONTROL_BYTES;
    /// Worker to console, and console to the others: what paths left.
    PathsLeft = 22, SCENE_BYTES;
    /// Worker to console: a unit came to nothing.
    UnitDropped = 23, CONTROL_BYTES;
}

impl TryFrom<u8> for FrameKind {
    type Error = FrameError;

    fn try_from(number: u8) -> Result<Self, FrameError> {
        let mut kinds = Self::ALL.iter();
        kinds
            .find(|&&kind| kind as u8 == number)
            .copied()
            .ok_or(FrameError::Kind(number))
    }
}
