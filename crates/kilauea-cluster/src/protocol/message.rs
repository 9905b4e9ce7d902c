//! Messages: a control record, and bulk data after it that no codec touches.
//!
//! A body is the length of the record (u32), the record as [`super::codec`] writes it, and the rest.

use std::ops::Range;

use kilauea_render::{Broadcast, Packing, PathPass, RenderStats, Tally, Unit};
use kilauea_scene::RenderSettings;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::{Frame, FrameError, FrameKind, codec};
use crate::stats::NetworkStats;

/// A record that a frame of one kind holds.
pub trait Message: Serialize + DeserializeOwned {
    /// That kind.
    const KIND: FrameKind;

    /// A frame of this record and bulk data.
    fn frame(&self, epoch: u32, bulk: &[u8]) -> Frame {
        let record = codec::encode(self);
        let mut body = Vec::with_capacity(4 + record.len() + bulk.len());
        body.extend((record.len() as u32).to_le_bytes());
        body.extend(record);
        body.extend(bulk);
        Frame::new(Self::KIND, epoch, body)
    }

    /// The record of a frame, and its bulk data.
    fn read(frame: &Frame) -> Result<(Self, &[u8]), FrameError> {
        if frame.kind != Self::KIND {
            return Err(FrameError::Unexpected {
                found: frame.kind,
                expected: std::any::type_name::<Self>(),
            });
        }
        let fail = |reason: String| FrameError::Body {
            kind: frame.kind,
            reason,
        };
        let cut = || fail("it ends within its record".into());
        let (length, rest) = frame.body.split_first_chunk().ok_or_else(cut)?;
        let length = u32::from_le_bytes(*length) as usize;
        let (record, bulk) = rest.split_at_checked(length).ok_or_else(cut)?;
        Ok((codec::decode(record).map_err(fail)?, bulk))
    }
}

/// Declares which kind of frame holds a record.
macro_rules! messages {
    ($($record:ident,)+) => {
        $(impl Message for $record {
            const KIND: FrameKind = FrameKind::$record;
        })+
    };
}

messages! {
    Challenge, Hello, Refused, Heartbeat, Start, SceneBytes, Ready, Lease, PassesOver, UnitDone,
    UnitRefused, Finish, Report, Failed, Manifest, Members, Chunk, PathsWanted, PathsLent, PathsLeft,
    UnitDropped,
}

/// What a worker has to mix into its proof.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Challenge {
    /// Random.
    pub nonce: [u8; 32],
}

/// Who one is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// First and last protocol that one speaks.
    pub protocols: [u16; 2],
    /// Of the source and the build settings: equal pixels are promised between equal builds.
    pub build_hash: u64,
    /// Whether numbers lie in memory as they do on the wire.
    pub is_little_endian: bool,
    /// Of the scene that one has: of the console, or of a worker's last frame.
    pub scene_hash: Option<[u8; 32]>,
    /// The session.
    pub session: u64,
    /// Number of the worker.
    pub rank: u32,
    /// How often the worker was started before.
    pub incarnation: u32,
    /// The worker's life that begins here.
    pub epoch: u32,
    /// What the other side has to mix into its proof.
    pub nonce: [u8; 32],
    /// Made from the token, the other side's nonce and all of the above.
    pub proof: [u8; 32],
}

/// Why one is sent away.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Refused {
    /// In words.
    pub reason: String,
}

/// One is alive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Heartbeat {
    /// Highest resident size of the process, bytes.
    pub peak_rss: u64,
}

/// What is to be rendered; the bulk data is the camera, which is not in the scene's bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Start {
    /// As for a process that renders alone; threads are those of one worker.
    pub settings: RenderSettings,
    /// Whether rays skip the code for what the scene does not have.
    pub specialize_rays: bool,
    /// Bytes of the scene, which follows in pieces; 0 where the worker has it. In a set, of what all of
    /// its members have.
    pub n_scene_bytes: u64,
    /// BLAKE3 of those bytes.
    pub scene_hash: [u8; 32],
    /// The worker's place in a set; none where each worker has the whole scene.
    pub seat: Option<Seat>,
}

/// A worker's place in a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Seat {
    /// Of the member in the set.
    pub number: u32,
    /// Of the bytes of the scene, the last ones: what is to be known of the whole.
    pub n_outline_bytes: u64,
    /// Chunks that follow.
    pub n_chunks: u32,
    /// Which members are asked what a ray meets.
    pub broadcast: Broadcast,
    /// How rays and hits are packed.
    pub packing: Packing,
    /// Bytes that each member has left for photons, where that is known.
    pub photon_bytes: Option<u64>,
}

/// Says that the bulk data is a chunk, or a piece of one whose last piece has the flag.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Chunk {
    /// The prototype that it is of.
    pub prototype: u32,
    /// Its number there: meshes come first, then points, then curves.
    pub number: u32,
}

/// The members of a set that are ready to answer.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Members {
    /// In any order.
    pub members: Vec<MemberAddress>,
}

/// Where a member of a set answers.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MemberAddress {
    /// Of the member in the set.
    pub number: u32,
    /// Its life.
    pub epoch: u32,
    /// Host and port.
    pub address: String,
}

/// Says that the bulk data is a piece of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SceneBytes;

/// Units may come.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ready {
    /// Engine threads.
    pub n_threads: u32,
    /// Where it answers other members of its set, host and port; none without a set.
    pub address: Option<String>,
}

/// A unit, lent to one worker until a time that the console knows.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lease {
    /// Of this lease.
    pub id: u64,
    /// What is to be rendered.
    pub unit: Unit,
    /// What its tile starts from.
    pub start: LeaseStart,
}

/// What the tile of a lease starts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum LeaseStart {
    /// No samples.
    Empty,
    /// What the worker has of it.
    Kept,
    /// The bulk data.
    Sums,
}

/// Passes that no unit will begin in any more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PassesOver {
    /// How many, from the first on.
    pub n_passes: u32,
}

/// A unit is done; the bulk data is the sums of its tile.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnitDone {
    /// Of the lease.
    pub lease: u64,
    /// What was rendered.
    pub unit: Unit,
    /// What was counted.
    pub tally: Tally,
}

/// A unit cannot be rendered.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnitRefused {
    /// Of the lease.
    pub lease: u64,
    /// What was to be rendered.
    pub unit: Unit,
    /// Why it cannot.
    pub reason: String,
}

/// A unit came to nothing, as other members of the set had its photons no more. Whoever is as far as
/// they are may have it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnitDropped {
    /// Of the lease.
    pub lease: u64,
    /// What was rendered.
    pub unit: Unit,
}

/// There are no more units.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Finish;

/// What a worker says of itself in the end.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Report {
    /// Its statistics, without what was counted for units.
    pub stats: RenderStats,
    /// What went over its links with other members of its set.
    pub links: NetworkStats,
}

/// The frame cannot be rendered, by anyone.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failed {
    /// Why.
    pub reason: String,
}

/// The worker needs what all paths of a pass leave, and can follow some of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PathsWanted {
    /// The pass.
    pub pass: PathPass,
}

/// Paths for the worker to follow.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PathsLent {
    /// The pass.
    pub pass: PathPass,
    /// Their numbers.
    pub paths: Range<u32>,
}

/// Says that the bulk data is what paths left.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PathsLeft {
    /// The pass.
    pub pass: PathPass,
    /// Their numbers.
    pub paths: Range<u32>,
}

/// What a journal is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Manifest {
    /// As in [`Hello`].
    pub build_hash: u64,
    /// BLAKE3 of the scene.
    pub scene_hash: [u8; 32],
    /// BLAKE3 of the settings that the image depends on.
    pub settings_hash: [u8; 32],
}
