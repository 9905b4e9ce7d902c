//! A scene spread over the members of a set: each holds a part of the surfaces and answers for it.
//!
//! What a ray meets is asked of the members whose chunks it pierces, each of which answers with the
//! nearest hit on what it holds; the front-most of all answers is the scene's. Who asks has no
//! surfaces, so that an answer brings what a shader needs of the one that was hit.

mod ask;
mod boxes;
mod carried_wire;
mod cut;
pub mod fuzzing;
mod member;
mod owners;
mod server;
mod traffic;
mod units;
mod wire;

pub(crate) use ask::Asker;
pub use ask::Broadcast;
pub use owners::{PlacementError, SetPlan};
pub(crate) use server::SetParts;
pub(crate) use traffic::Traffic;
pub use traffic::{MemberStats, RaySample, RayTraffic, SetStats};
pub use wire::Packing;

use std::sync::Arc;

use kilauea_scene::Scene;
use kilauea_texture::{TextureError, TextureStore};

use crate::RenderError;
use crate::geometry::{Geometry, Outline};
use crate::prepared::PrepareOptions;
use boxes::ChunkBoxes;
use cut::cut;
use member::Member;

/// A set in this process.
pub struct Set {
    members: Vec<Member>,
    boxes: ChunkBoxes,
}

/// Bytes that a member of a set holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct MemberBytes {
    /// Chunks.
    pub scene: u64,
    /// Trees over what is in them.
    pub accel: u64,
}

impl Set {
    /// Gives each member its part of a whole scene. Returns what who asks has left: all that is not
    /// a surface, and surfaces that shine.
    pub(crate) fn new(
        scene: &Scene,
        plan: &SetPlan,
        options: &PrepareOptions,
    ) -> Result<(Arc<Scene>, Geometry, Self), RenderError> {
        let outline = Arc::new(Outline::of(scene)?);
        let n_members = plan.n_members();
        let texture_bytes = options.texture_memory_bytes / n_members as u64;
        let members = (0..n_members).map(|number| {
            let part = Arc::new(cut(scene, |chunk, _| plan.owner(chunk) == number));
            let (textures, _) = TextureStore::open(&part.textures, texture_bytes);
            let is_here = |chunk| plan.owner(chunk) == number;
            let outline = Some(Arc::clone(&outline));
            let geometry = Geometry::build_part(Arc::clone(&part), outline, is_here, options)?;
            Ok(Member {
                scene: part,
                geometry,
                textures,
            })
        });
        let members: Vec<Member> = members.collect::<Result<_, RenderError>>()?;
        let shines = |material: u32| {
            let shaders = members[0].geometry.shaders();
            shaders[material as usize].is_emissive()
        };
        let left = Arc::new(cut(scene, |_, material| shines(material)));
        let geometry = Geometry::build_part(Arc::clone(&left), Some(outline), |_| false, options)?;
        let boxes = ChunkBoxes::new(scene, &geometry, plan);
        Ok((left, geometry, Self { members, boxes }))
    }

    /// Bytes that each member holds.
    pub(crate) fn bytes(&self) -> Vec<MemberBytes> {
        self.members.iter().map(Member::bytes).collect()
    }

    /// What went wrong with images of cut-outs since this was asked last.
    pub(crate) fn take_texture_errors(&self) -> Vec<TextureError> {
        let errors = self.members.iter().map(|m| m.textures.take_errors());
        errors.flatten().collect()
    }

    /// What no ray can hit, in a line for each member that leaves something out.
    pub(crate) fn left_out(&self) -> impl Iterator<Item = String> + '_ {
        self.members.iter().filter_map(|m| m.geometry.left_out())
    }
}
