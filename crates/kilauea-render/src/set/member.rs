use std::sync::Arc;

use kilauea_scene::Scene;
use kilauea_texture::TextureStore;

use super::MemberBytes;
use super::parcel::Parcel;
use super::partners::Remote;
use crate::geometry::Geometry;
use crate::integrator::{Answer, Blame, Met, Question, RayTracer};

/// Who holds a part of the surfaces.
pub(super) enum Member {
    /// Another in this process.
    Beside(Box<Part>),
    /// Who asks: its surfaces are those of the prepared scene.
    Own,
    /// Another process.
    Elsewhere(Remote),
}

impl Member {
    /// What answers for one in this process that is not who asks.
    pub(super) fn tracer<'a, const CUTOUTS: bool>(
        &'a self,
        blame: &'a Blame,
    ) -> Option<RayTracer<'a, CUTOUTS>> {
        match self {
            Self::Beside(part) => Some(RayTracer::of_part(&part.geometry, &part.textures, blame)),
            Self::Own | Self::Elsewhere(_) => None,
        }
    }
}

/// A part of the surfaces.
pub(super) struct Part {
    pub(super) scene: Arc<Scene>,
    pub(super) geometry: Geometry,
    /// For cut-outs.
    pub(super) textures: TextureStore,
}

impl Part {
    pub(super) fn bytes(&self) -> MemberBytes {
        MemberBytes::of(&self.scene, &self.geometry)
    }
}

impl MemberBytes {
    /// Of a part of a scene.
    pub(crate) fn of(scene: &Scene, geometry: &Geometry) -> Self {
        Self {
            scene: scene.n_bytes() as u64,
            accel: geometry.accel().n_bytes() as u64,
        }
    }
}

impl<const CUTOUTS: bool> RayTracer<'_, CUTOUTS> {
    /// The nearest of a part, with what others need of it.
    pub(super) fn answer_of_part(&self, question: Question) -> Answer {
        let answer = self.answer_here(question);
        match (answer, question) {
            (Answer::Closest(Some(hit)), Question::Closest { ray, .. }) => {
                let at = self.geometry.locate(&hit);
                let carried = self.geometry.carry(at, ray.time);
                Answer::Met(Met {
                    hit,
                    parcel: Parcel::Open(Box::new(carried)),
                })
            }
            (answer, _) => answer,
        }
    }
}
