//! What a worker gets first: the settings, then the scene or its part of it.

use std::time::Instant;

use super::set::Parts;
use crate::link::FrameWriter;
use crate::protocol::{FrameError, Hello, Message, SceneBytes, Start};

/// Bytes of a piece of the scene.
const PIECE_BYTES: usize = 16 << 20;
/// Least time that a worker is given.
const LEAST_SECS: f64 = 0.001;

/// What workers get first.
pub(super) struct Payload {
    pub(super) start: Start,
    pub(super) camera: Vec<u8>,
    pub(super) scene: SceneForWorkers,
    /// Of the whole scene.
    pub(super) scene_hash: [u8; 32],
    /// When the frame began.
    pub(super) begun: Instant,
}

/// The scene as workers have it.
pub(super) enum SceneForWorkers {
    /// Each has all of it.
    Whole(Vec<u8>),
    /// Each has a part.
    Parts(Parts),
}

impl SceneForWorkers {
    /// What all of them have of it.
    pub(super) fn common(&self) -> &[u8] {
        match self {
            Self::Whole(scene) => scene,
            Self::Parts(parts) => &parts.common,
        }
    }
}

impl Payload {
    /// Whether a worker has the whole scene since an earlier frame, and needs no other part.
    pub(super) fn is_kept_by(&self, hello: &Hello) -> bool {
        hello.scene_hash == Some(self.scene_hash) && matches!(self.scene, SceneForWorkers::Whole(_))
    }

    /// Sends it to the worker of a rank, the scene only where it is not kept there.
    pub(super) async fn send(
        &self,
        writer: &mut FrameWriter,
        keeps_scene: bool,
        [rank, epoch]: [u32; 2],
    ) -> Result<(), FrameError> {
        let mut start = self.start.clone();
        start.settings.time_limit_secs = start
            .settings
            .time_limit_secs
            .map(|limit| (limit - self.begun.elapsed().as_secs_f64()).max(LEAST_SECS));
        if let SceneForWorkers::Parts(parts) = &self.scene {
            start.seat = Some(parts.seat(rank));
        }
        let common = if keeps_scene {
            &[]
        } else {
            self.scene.common()
        };
        start.n_scene_bytes = common.len() as u64;
        writer.write(&start.frame(epoch, &self.camera)).await?;
        let n_pieces = common.len().div_ceil(PIECE_BYTES);
        for (i, piece) in common.chunks(PIECE_BYTES).enumerate() {
            let mut frame = SceneBytes.frame(epoch, piece);
            frame.is_last = i + 1 == n_pieces;
            writer.write(&frame).await?;
        }
        match &self.scene {
            SceneForWorkers::Whole(_) => Ok(()),
            SceneForWorkers::Parts(parts) => parts.send_chunks(writer, rank, epoch).await,
        }
    }
}
