//! Receives a part of a scene, chunk by chunk: never is there more of it than that part and the bytes of
//! one chunk.

use kilauea_render::SetOutline;
use kilauea_scene::Scene;

use crate::link::FrameReader;
use crate::protocol::{Chunk, Frame, FrameError, FrameKind, Message, Seat};
use crate::scene::{SceneBytesError, put_chunk, scene_from_bytes};
use crate::worker::WorkerError;

/// Pieces of one chunk that are kept, at most: one of 65,536 primitives takes some megabytes for each
/// motion key.
const MAX_CHUNK_BYTES: usize = 1 << 31;

/// What a member of a set has of a scene.
pub(crate) struct Part {
    /// With husks in place of what others have.
    pub(crate) scene: Scene,
    /// Of the whole.
    pub(crate) outline: SetOutline,
}

/// Receives the chunks of a part, once `common` is there: what all members have, and the outline.
pub(crate) async fn receive_part(
    reader: &mut FrameReader,
    seat: &Seat,
    common: Vec<u8>,
) -> Result<Part, WorkerError> {
    let n_husk_bytes = usize::try_from(seat.n_outline_bytes)
        .ok()
        .and_then(|n| common.len().checked_sub(n))
        .ok_or(WorkerError::SceneHash)?;
    let (husk, outline) = common.split_at(n_husk_bytes);
    let mut scene = scene_from_bytes(husk)?;
    let outline = rmp_serde::from_slice(outline).map_err(SceneBytesError::from)?;
    drop(common);
    for _ in 0..seat.n_chunks {
        let (Chunk { prototype, number }, bytes) = receive_chunk(reader).await?;
        put_chunk(&mut scene, prototype, number, &bytes)?;
    }
    Ok(Part { scene, outline })
}

/// Receives the pieces of a chunk.
async fn receive_chunk(reader: &mut FrameReader) -> Result<(Chunk, Vec<u8>), WorkerError> {
    let mut bytes = Vec::new();
    loop {
        let frame = next_frame(reader).await?;
        let (chunk, piece) = Chunk::read(&frame)?;
        if frame.is_last && bytes.is_empty() {
            return Ok((chunk, piece.to_vec()));
        }
        bytes.extend_from_slice(piece);
        if bytes.len() > MAX_CHUNK_BYTES {
            return Err(FrameError::Body {
                kind: FrameKind::Chunk,
                reason: "its pieces are too many".into(),
            }
            .into());
        }
        if frame.is_last {
            return Ok((chunk, bytes));
        }
    }
}

/// The next frame that is more than a sign of life.
async fn next_frame(reader: &mut FrameReader) -> Result<Frame, FrameError> {
    loop {
        let frame = reader.read().await?;
        if frame.kind != FrameKind::Heartbeat {
            return Ok(frame);
        }
    }
}
