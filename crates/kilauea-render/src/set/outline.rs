//! What a member of a set must know of the whole scene besides its part.

use kilauea_math::Bounds3;
use kilauea_scene::Scene;
use serde::{Deserialize, Serialize};

use super::SetPlan;
use super::units::{chunk_bounds, chunk_bytes};
use crate::RenderError;
use crate::geometry::Outline;
use crate::photon::PhotonPart;
use crate::stats::SceneSize;

/// What a member of a set must know of the whole scene besides its part: how primitives are numbered
/// and where they are rounded, where chunks are, and who holds them. A kilobyte a chunk at most, and
/// one byte for each placement.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SetOutline {
    pub(super) whole: Outline,
    pub(super) chunks: ChunkOutlines,
    pub(super) plan: SetPlan,
    pub(super) size: SceneSize,
}

/// By prototype and chunk.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct ChunkOutlines {
    /// Boxes in the space of the chunks, around pieces of them at all times.
    pub(super) bounds: Vec<Vec<Vec<Bounds3>>>,
    /// Of arrays and trees, as far as that is known beforehand.
    pub(super) bytes: Vec<Vec<u64>>,
}

impl SetOutline {
    /// Of a whole scene that is spread by a plan.
    pub fn of(scene: &Scene, plan: &SetPlan) -> Result<Self, RenderError> {
        Ok(Self {
            whole: Outline::of(scene)?,
            chunks: ChunkOutlines {
                bounds: scene.prototypes.iter().map(chunk_bounds).collect(),
                bytes: scene.prototypes.iter().map(chunk_bytes).collect(),
            },
            plan: plan.clone(),
            size: SceneSize::of(scene),
        })
    }

    /// The photons that fall to a member, where they are divided.
    pub fn photon_part(&self, number: usize) -> PhotonPart {
        PhotonPart {
            number,
            n_members: self.plan.n_members(),
        }
    }

    /// Refuses a part of another scene, and a member that there is not.
    pub(super) fn check(&self, part: &Scene, number: usize) -> Result<(), RenderError> {
        let n_chunks = || {
            part.prototypes
                .iter()
                .map(kilauea_scene::Prototype::n_chunks)
        };
        let fits = n_chunks().eq(self.chunks.bounds.iter().map(Vec::len))
            && n_chunks().eq(self.chunks.bytes.iter().map(Vec::len))
            && self.plan.fits(n_chunks())
            && number < self.plan.n_members();
        fits.then_some(()).ok_or(RenderError::OtherScene)
    }
}
