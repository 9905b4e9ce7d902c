//! A member of a set that is a process of its own.

use std::sync::Arc;
use std::time::Instant;

use kilauea_scene::Scene;

use super::boxes::ChunkBoxes;
use super::cut::cut;
use super::member::Member;
use super::outline::SetOutline;
use super::partners::{Partners, Remote};
use super::{Packing, Set, SetPlan};
use crate::RenderError;
use crate::geometry::{ChunkId, Geometry};
use crate::prepared::{PrepareOptions, PreparedScene};

/// Which member of a set this process is, and how it reaches the others.
pub struct MemberSeat {
    /// What it must know of the whole scene.
    pub outline: SetOutline,
    /// Its number.
    pub number: usize,
    /// The others.
    pub partners: Arc<dyn Partners>,
    /// How questions to them are packed.
    pub packing: Packing,
    /// Bytes that a member has left for photons, where that is known: the same for all.
    pub photon_bytes: Option<u64>,
}

impl Set {
    /// The scene without any of its surfaces: what all members have. All numbers are those of the
    /// whole.
    pub fn husk(scene: &Scene) -> Scene {
        cut(scene, |_, _| false)
    }

    /// Chunks that a member holds or must have: those that are placed on it, and those that shine, by
    /// prototype and number in it, where meshes come first, then points, then curves.
    ///
    /// # Errors
    /// If a material cannot be shaded.
    pub fn chunks_of(
        scene: &Scene,
        plan: &SetPlan,
        number: usize,
    ) -> Result<Vec<[u32; 2]>, RenderError> {
        let shines = super::shining(scene)?;
        let mut held = Vec::new();
        for (prototype, of) in (0..).zip(&scene.prototypes) {
            let meshes = of.chunks.iter().map(|c| c.material);
            let points = of.points.iter().map(|c| c.material);
            let curves = of.curves.iter().map(|c| c.material);
            for (chunk, material) in (0..).zip(meshes.chain(points).chain(curves)) {
                let owner = plan.owner(ChunkId { prototype, chunk });
                if owner == number || shines[material as usize] {
                    held.push([prototype, chunk]);
                }
            }
        }
        Ok(held)
    }
}

impl PreparedScene {
    /// Prepares the part of a scene that a member of a set has: all that is not a surface, its own
    /// chunks, and those that shine. The images are those of the whole scene.
    ///
    /// # Errors
    /// If the part breaks a rule of scenes, or is of another scene than the seat's outline.
    pub fn member(
        part: Scene,
        seat: MemberSeat,
        options: &PrepareOptions,
    ) -> Result<Self, RenderError> {
        let start = Instant::now();
        part.validate()?;
        let MemberSeat {
            outline,
            number,
            partners,
            packing,
            photon_bytes,
        } = seat;
        outline.check(&part, number)?;
        let SetOutline {
            whole,
            chunks,
            plan,
            size,
        } = outline;
        let part = Arc::new(part);
        let is_own = |chunk| plan.owner(chunk) == number;
        let whole = Some(Arc::new(whole));
        let geometry = Geometry::build_part(Arc::clone(&part), whole, is_own, options)?;
        let boxes = ChunkBoxes::new(&chunks, &geometry, &plan);
        let member = |other| {
            if other == number {
                return Member::Own;
            }
            let partners = Arc::clone(&partners);
            Member::Elsewhere(Remote {
                number: other,
                partners,
                packing,
            })
        };
        let members = (0..plan.n_members()).map(member).collect();
        let own = Some(number);
        let set = Some(Set {
            members,
            own,
            boxes,
            photons: Arc::default(),
            photon_bytes,
        });
        Ok(Self::around((part, geometry, set), size, options, start))
    }
}
