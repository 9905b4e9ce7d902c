//! The parts of a scene as they go to the members of a set.

use kilauea_render::{Set, SetOutline};
use kilauea_scene::Scene;

use super::Sets;
use crate::error::ClusterError;
use crate::link::FrameWriter;
use crate::protocol::{Chunk, FrameError, Message, Seat};
use crate::scene::{SceneChunks, scene_to_bytes};

/// Bytes of a piece of a chunk.
const PIECE_BYTES: usize = 16 << 20;

/// A scene in parts. The console has all of it, once, whoever asks for which part and how often.
pub(in crate::console) struct Parts {
    scene: SceneChunks,
    /// What all members have: the scene without its chunks, and the outline of the whole.
    pub(in crate::console) common: Vec<u8>,
    /// Of the outline in it, the last ones.
    n_outline_bytes: u64,
    /// Chunks of each member, by prototype and number in it.
    held: Vec<Vec<[u32; 2]>>,
    sets: Sets,
}

impl Parts {
    pub(in crate::console) fn of(
        scene: &Scene,
        chunks: SceneChunks,
        sets: &Sets,
    ) -> Result<Self, ClusterError> {
        let outline = SetOutline::of(scene, &sets.plan)?;
        let outline = rmp_serde::to_vec_named(&outline).expect("outlines can be written");
        let n_outline_bytes = outline.len() as u64;
        let common = [scene_to_bytes(&Set::husk(scene)), outline].concat();
        let held = |member| Set::chunks_of(scene, &sets.plan, member);
        let held = (0..sets.plan.n_members()).map(held);
        Ok(Self {
            held: held.collect::<Result<_, _>>()?,
            scene: chunks,
            common,
            n_outline_bytes,
            sets: sets.clone(),
        })
    }

    /// The place of a worker.
    pub(in crate::console) fn seat(&self, rank: u32) -> Seat {
        let number = self.sets.number(rank);
        Seat {
            number,
            n_outline_bytes: self.n_outline_bytes,
            n_chunks: self.held[number as usize].len() as u32,
            broadcast: self.sets.options.broadcast,
            packing: self.sets.options.packing,
            photon_bytes: self.sets.photon_room.map(|room| room.left),
        }
    }

    /// Sends a worker its chunks, one after the other.
    pub(in crate::console) async fn send_chunks(
        &self,
        writer: &mut FrameWriter,
        rank: u32,
        epoch: u32,
    ) -> Result<(), FrameError> {
        for &[prototype, number] in &self.held[self.sets.number(rank) as usize] {
            let bytes = self.scene.chunk(prototype, number);
            let chunk = Chunk { prototype, number };
            let n_pieces = bytes.len().div_ceil(PIECE_BYTES);
            for (i, piece) in bytes.chunks(PIECE_BYTES).enumerate() {
                let mut frame = chunk.frame(epoch, piece);
                frame.is_last = i + 1 == n_pieces;
                writer.write(&frame).await?;
            }
        }
        Ok(())
    }
}
