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
mod outline;
mod owners;
mod parcel;
mod partners;
mod photons;
mod pieces;
mod process;
mod server;
mod traffic;
mod units;
mod wire;

pub(crate) use ask::Asker;
pub use ask::Broadcast;
pub use outline::SetOutline;
pub use owners::{PlacementError, SetPlan};
pub(crate) use parcel::Parcel;
pub use partners::{Answered, Partners, PartnersGone};
pub(crate) use photons::{MOST_PASSES, PassParts, PhotonParts};
pub use process::MemberSeat;
pub(crate) use server::SetParts;
pub(crate) use traffic::Traffic;
pub use traffic::{MemberStats, PhotonRoom, RaySample, RayTraffic, SetStats};
pub use wire::Packing;

use std::sync::Arc;

use kilauea_scene::Scene;
use kilauea_texture::{TextureError, TextureStore};
use shaders::Shader;

use crate::RenderError;
use crate::geometry::Geometry;
use crate::photon::PhotonPart;
use crate::prepared::PrepareOptions;
use boxes::ChunkBoxes;
use cut::cut;
use member::{Member, Part};

/// A set: its members, in this process or others, and where their chunks are.
pub struct Set {
    members: Vec<Member>,
    /// The member that is who asks, if any is.
    own: Option<usize>,
    boxes: ChunkBoxes,
    /// The photons that are divided, as far as the member that is who asks has them.
    pub(crate) photons: Arc<PhotonParts>,
    /// Bytes that a member has left for photons, where that is known.
    pub(crate) photon_bytes: Option<u64>,
}

/// Bytes that a member of a set holds; zeros where that is not known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
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
        let SetOutline { whole, chunks, .. } = SetOutline::of(scene, plan)?;
        let whole = Arc::new(whole);
        let n_members = plan.n_members();
        let texture_bytes = options.texture_memory_bytes / n_members as u64;
        let members = (0..n_members).map(|number| {
            let part = Arc::new(cut(scene, |chunk, _| plan.owner(chunk) == number));
            let (textures, _) = TextureStore::open(&part.textures, texture_bytes);
            let is_here = |chunk| plan.owner(chunk) == number;
            let whole = Some(Arc::clone(&whole));
            let geometry = Geometry::build_part(Arc::clone(&part), whole, is_here, options)?;
            Ok(Member::Beside(Box::new(Part {
                scene: part,
                geometry,
                textures,
            })))
        });
        let members: Vec<Member> = members.collect::<Result<_, RenderError>>()?;
        let shines = shining(scene)?;
        let left = Arc::new(cut(scene, |_, material| shines[material as usize]));
        let geometry = Geometry::build_part(Arc::clone(&left), Some(whole), |_| false, options)?;
        let boxes = ChunkBoxes::new(&chunks, &geometry, plan);
        Ok((
            left,
            geometry,
            Self {
                members,
                own: None,
                boxes,
                photons: Arc::default(),
                photon_bytes: None,
            },
        ))
    }

    /// Members in this process, by number, each with the part of the photons that falls to it; none for
    /// those that are elsewhere.
    pub(crate) fn photon_parts(&self) -> impl Iterator<Item = Option<PhotonPart>> + '_ {
        let n_members = self.members.len();
        let numbered = self.members.iter().enumerate();
        numbered.map(move |(number, member)| {
            let is_here = !matches!(member, Member::Elsewhere(_));
            is_here.then_some(PhotonPart { number, n_members })
        })
    }

    /// Members.
    pub(crate) fn n_members(&self) -> usize {
        self.members.len()
    }

    /// Whether who asks is a member.
    pub(crate) fn has_own(&self) -> bool {
        self.own.is_some()
    }

    /// Bytes that each member holds; `own` if it is who asks.
    pub(crate) fn bytes(&self, own: MemberBytes) -> Vec<MemberBytes> {
        let bytes = |member: &Member| match member {
            Member::Beside(part) => part.bytes(),
            Member::Own => own,
            Member::Elsewhere(_) => MemberBytes::default(),
        };
        self.members.iter().map(bytes).collect()
    }

    /// Bytes that all members hold that are in this process beside who asks.
    pub(crate) fn bytes_beside(&self) -> MemberBytes {
        let bytes = self.parts().map(Part::bytes);
        bytes.fold(MemberBytes::default(), |all, part| MemberBytes {
            scene: all.scene + part.scene,
            accel: all.accel + part.accel,
        })
    }

    fn parts(&self) -> impl Iterator<Item = &Part> {
        self.members.iter().filter_map(|member| match member {
            Member::Beside(part) => Some(&**part),
            Member::Own | Member::Elsewhere(_) => None,
        })
    }

    /// What went wrong with images of cut-outs since this was asked last.
    pub(crate) fn take_texture_errors(&self) -> Vec<TextureError> {
        let errors = self.parts().map(|part| part.textures.take_errors());
        errors.flatten().collect()
    }

    /// What no ray can hit, in a line for each member that leaves something out.
    pub(crate) fn left_out(&self) -> impl Iterator<Item = String> + '_ {
        self.parts().filter_map(|part| part.geometry.left_out())
    }
}

/// Whether surfaces of each material shine.
fn shining(scene: &Scene) -> Result<Vec<bool>, RenderError> {
    let shaders = scene.materials.iter().map(Shader::compile);
    let shines = shaders.map(|shader| Ok(shader?.is_emissive()));
    shines.collect()
}
