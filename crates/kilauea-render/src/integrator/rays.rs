//! Answers what paths ask, where the geometry and the files are.

use kilauea_accel::{Hit, Ray};
use kilauea_math::Vec2;
use kilauea_math::hash::{combine, unit_f32};
use kilauea_spot::{Answerer, Program};
use kilauea_texture::{TextureStore, TileId};

use super::blame::Blame;
use super::media::is_hidden;
use super::question::{Answer, Question};
use crate::geometry::{Geometry, View};
use crate::prepared::PreparedScene;
use crate::set::{Asker, Broadcast, PhotonParts};

/// Traces rays.
///
/// `CUTOUTS` is whether any surface lets rays pass, because it is partly absent or hidden by a
/// medium: the general code with `CUTOUTS` and the special one without give the same answers where
/// none does.
#[derive(Clone, Copy)]
pub(crate) struct RayTracer<'a, const CUTOUTS: bool> {
    /// Surfaces.
    pub geometry: &'a Geometry,
    /// Images, for what depends on opacity, and for those who ask for their tiles.
    pub textures: &'a TextureStore,
    /// Whether those who ask have a memory of their own, so that tiles are sent to them.
    pub sends_texels: bool,
    /// Where a shader that panics leaves its name.
    pub blame: &'a Blame,
    /// Who holds the surfaces that rays meet, if they are not here.
    pub(crate) set: Option<Asker<'a>>,
}

impl<P, const CUTOUTS: bool> Answerer<P> for RayTracer<'_, CUTOUTS>
where
    P: Program<Question = Question, Answer = Answer>,
{
    #[inline]
    fn answer(&self, question: Question) -> Answer {
        self.answer_to(question)
    }

    fn is_slow(&self, question: &Question) -> bool {
        matches!(question, Question::Tile(_))
    }
}

impl<'a, const CUTOUTS: bool> RayTracer<'a, CUTOUTS> {
    /// Answers for a whole scene.
    pub(crate) fn of(prepared: &'a PreparedScene, blame: &'a Blame) -> Self {
        let set = prepared.set.as_ref().map(|set| Asker {
            set,
            geometry: &prepared.geometry,
            textures: &prepared.textures,
            broadcast: Broadcast::default(),
            photons: &set.photons,
        });
        Self {
            set,
            ..Self::of_part(&prepared.geometry, &prepared.textures, blame)
        }
    }

    /// Answers for surfaces that are here.
    pub(crate) fn of_part(
        geometry: &'a Geometry,
        textures: &'a TextureStore,
        blame: &'a Blame,
    ) -> Self {
        Self {
            geometry,
            textures,
            sends_texels: false,
            blame,
            set: None,
        }
    }

    /// The same, asking those of a set that `broadcast` says, for photons as well.
    pub(crate) fn asking(self, broadcast: Broadcast, photons: &'a PhotonParts) -> Self {
        let set = self.set.map(|asker| Asker {
            broadcast,
            photons,
            ..asker
        });
        Self { set, ..self }
    }

    /// The answer, which does not depend on where surfaces are.
    #[inline]
    pub(crate) fn answer_to(&self, question: Question) -> Answer {
        match &self.set {
            Some(asker) => asker.answer::<CUTOUTS>(question, self.blame),
            None => self.answer_here(question),
        }
    }

    /// The answer as far as surfaces are here.
    #[inline]
    pub(crate) fn answer_here(&self, question: Question) -> Answer {
        match question {
            Question::Closest { ray, key } => Answer::Closest(self.closest(&ray, key)),
            Question::Occluded {
                ray,
                key,
                least_priority,
            } => Answer::Occluded(self.is_occluded(&ray, key, least_priority)),
            Question::Tile(tile) => Answer::Tile(self.bring(tile)),
            // They are asked of sets alone.
            Question::Photons(_) => Answer::Photons(None),
        }
    }

    /// Brings a tile to where it was asked for. What cannot be read is left to the lookup that needs
    /// it, which does without.
    #[cold]
    fn bring(&self, tile: TileId) -> Option<Box<[u8]>> {
        if self.sends_texels {
            return self.textures.read_texels(tile);
        }
        self.textures.fetch(tile);
        None
    }

    #[inline]
    fn closest(&self, ray: &Ray, key: u32) -> Option<Hit> {
        let accel = self.geometry.accel();
        if CUTOUTS {
            accel.intersect_filtered(ray, |hit| self.is_present(hit, ray, key))
        } else {
            accel.intersect(ray)
        }
    }

    #[inline]
    fn is_occluded(&self, ray: &Ray, key: u32, least_priority: i8) -> bool {
        let accel = self.geometry.accel();
        if CUTOUTS {
            accel.occluded_filtered(ray, |hit| {
                let shader = self.geometry.shader(self.geometry.locate(hit));
                !is_hidden(shader, least_priority) && self.is_present(hit, ray, key)
            })
        } else {
            accel.occluded(ray)
        }
    }

    /// Whether a surface stops a ray. Partial presence is decided by a number that depends on the
    /// ray and the primitive alone, so it does not matter in which order a tree offers candidates,
    /// or whether twice.
    fn is_present(&self, hit: &Hit, ray: &Ray, key: u32) -> bool {
        let at = self.geometry.locate(hit);
        let shader = self.geometry.shader(at);
        if shader.is_opaque() {
            return true;
        }
        let view = View {
            uv: Vec2::new(hit.u, hit.v),
            p_ray: ray.at(hit.t),
            wo: -ray.dir.normalize(),
            time: ray.time,
            footprint: 0.0,
        };
        let interaction = self.geometry.interaction(at, &view, self.textures);
        let shading = self.blame.shading(at);
        let opacity = shader.opacity(&interaction.surface);
        drop(shading);
        let primitive_key = combine(hit.primitive, hit.instance);
        opacity >= 1.0 || unit_f32(combine(key, primitive_key)) < opacity
    }
}
