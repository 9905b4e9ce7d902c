use std::sync::Arc;

use kilauea_scene::Scene;
use kilauea_texture::TextureStore;

use super::MemberBytes;
use crate::geometry::Geometry;
use crate::integrator::{Answer, Blame, Met, Question, RayTracer};

/// Who holds a part of the surfaces.
pub(super) struct Member {
    pub(super) scene: Arc<Scene>,
    pub(super) geometry: Geometry,
    /// For cut-outs.
    pub(super) textures: TextureStore,
}

impl Member {
    /// The nearest of what is here, with what others need of it.
    pub(super) fn answer<const CUTOUTS: bool>(&self, question: Question, blame: &Blame) -> Answer {
        let tracer = RayTracer::<CUTOUTS>::of_part(&self.geometry, &self.textures, blame);
        let answer = tracer.answer_to(question);
        match (answer, question) {
            (Answer::Closest(Some(hit)), Question::Closest { ray, .. }) => {
                let at = self.geometry.locate(&hit);
                let carried = self.geometry.carry(at, ray.time);
                Answer::Met(Box::new(Met { hit, carried }))
            }
            (answer, _) => answer,
        }
    }

    pub(super) fn bytes(&self) -> MemberBytes {
        MemberBytes {
            scene: self.scene.n_bytes() as u64,
            accel: self.geometry.accel().n_bytes() as u64,
        }
    }
}
