//! Caustics by merging, beside hitting and connecting to lights.

use kilauea_bsdf::{Mirror, SeenBsdf};
use kilauea_math::{Spectrum, Vec3};
use kilauea_photon::{EyeSubpath, SurfaceQuery};
use kilauea_scene::Visibility;

use super::Merge;
use super::source::{Gathering, Lookup, PhotonSource};
use crate::geometry::Geometry;
use crate::integrator::guide::Knowledge;
use crate::integrator::question::{Answer, Question};
use crate::integrator::walk::{Segment, Vertex};
use crate::light::{ChosenLight, Emitted, Emitter};
use crate::photon::{MIN_ROUGHNESS, adjoint_pdf, is_specular};

/// Merges at the first vertex where a path does not scatter as by a mirror, with photons that came
/// over specular surfaces alone: L S⁺ D S* E.
///
/// Each such path is weighed against the other ways to find it by the balance heuristic
/// (`kilauea_photon::Merging`), all others are left as they are.
#[derive(Clone, Copy)]
pub(crate) struct CausticMerge<'a, S> {
    /// Of caustic photons.
    pub(crate) source: S,
    /// Of those that the photons were emitted by.
    pub(crate) emitter: &'a Emitter<'a>,
    pub(crate) geometry: &'a Geometry,
    pub(crate) gathering: Gathering,
    /// Specular surfaces that photons have met at most.
    pub(crate) max_specular: u32,
    /// Scattering events after which paths still merge: all that photons bring there, longer paths
    /// could find as well.
    pub(crate) max_depth: u32,
    /// Whether some rays do not meet something.
    pub(crate) has_masks: bool,
}

/// What a path that merges keeps of its way.
#[derive(Clone, Copy)]
pub(crate) struct MergingEye {
    stage: Stage,
    /// Light of photons, scattered by diffuse lobes and by all others.
    gathered: Option<[Spectrum; 2]>,
}

#[derive(Clone, Copy)]
enum Stage {
    /// Has been scattered by specular surfaces alone: S*E.
    Specular,
    /// Has been scattered at one vertex where it could merge, then by specular surfaces alone:
    /// S*DS*E.
    BehindRough {
        subpath: EyeSubpath,
        n_specular: u32,
    },
    /// Finds light that no photon has that is looked for.
    Other,
}

impl MergingEye {
    /// Keeps light until it is taken; whether there is any.
    fn keep(&mut self, gathered: [Spectrum; 2]) -> bool {
        let is_any = gathered.iter().any(|light| !light.is_black());
        self.gathered = is_any.then_some(gathered);
        is_any
    }
}

impl<S> CausticMerge<'_, S> {
    fn merges_at<M>(&self, vertex: &Vertex<'_, M>, bsdf: &SeenBsdf) -> bool {
        vertex.depth <= self.max_depth
            && bsdf.max_roughness() >= Some(MIN_ROUGHNESS)
            && !(self.has_masks && self.is_hidden_from_photons(vertex))
    }

    fn is_hidden_from_photons<M>(&self, vertex: &Vertex<'_, M>) -> bool {
        let met_by = self.geometry.met_by(vertex.interaction.at);
        met_by & Visibility::INDIRECT == Visibility::NONE
    }

    /// The part of a path behind its rough vertex, where one more specular surface is not too many for
    /// photons.
    fn before_specular(&self, eye: &MergingEye) -> Option<EyeSubpath> {
        match eye.stage {
            Stage::BehindRough {
                subpath,
                n_specular,
            } if n_specular < self.max_specular => Some(subpath),
            _ => None,
        }
    }

    /// The part of a path behind its rough vertex that goes on from a specular one to `wi`, which it
    /// chose with the density `pdf`; `is_delta` if there was no other direction.
    fn extend<M>(
        subpath: EyeSubpath,
        vertex: &Vertex<'_, M>,
        wi: Vec3,
        pdf: f32,
        is_delta: bool,
    ) -> EyeSubpath {
        let surface = &vertex.interaction.surface;
        let reverse_pdf = if is_delta {
            pdf
        } else {
            let bsdf = vertex.interaction.shader.bsdf(surface);
            adjoint_pdf(&bsdf, surface.ng, wi, surface.wo)
        };
        subpath.arrived(surface.wo.dot(surface.ng).abs()).scattered(
            pdf,
            reverse_pdf,
            wi.dot(surface.ng).abs(),
        )
    }

    /// `p` and the unit vector `wi` toward the light are of the ray that meets it.
    fn d_light(&self, subpath: EyeSubpath, light: u32, p: Vec3, wi: Vec3) -> f32 {
        subpath.d_light(self.emitter.density(light, p, -wi), 1.0)
    }
}

impl<S: PhotonSource> Merge for CausticMerge<'_, S> {
    type Eye = MergingEye;
    type Asked<R, K> = S::Asked<R, K>;

    fn start(&self) -> MergingEye {
        MergingEye {
            stage: Stage::Specular,
            gathered: None,
        }
    }

    fn gather<M, R, K: Knowledge>(
        &self,
        eye: &mut MergingEye,
        vertex: &Vertex<'_, M>,
        (bsdf, knowledge): (&SeenBsdf, &K),
        ask: impl FnOnce(Question) -> R,
        asked: &mut Self::Asked<R, K>,
    ) -> bool {
        if !matches!(eye.stage, Stage::Specular) || !self.merges_at(vertex, bsdf) {
            return false;
        }
        let surface = &vertex.interaction.surface;
        let lookup = Lookup {
            query: SurfaceQuery {
                p: surface.p,
                n: normal_toward(surface.ng, surface.wo),
            },
            bsdf,
            knowledge,
            passed: vertex.passed,
        };
        let found = self.source.look_up(&self.gathering, &lookup, ask, asked);
        found.is_none_or(|light| eye.keep(light))
    }

    async fn receive<R, K: Knowledge>(&self, eye: &mut MergingEye, asked: &mut Self::Asked<R, K>)
    where
        R: Future<Output = Answer> + Unpin,
    {
        if let Some(light) = self.source.receive(&self.gathering, asked).await {
            eye.keep(light);
        }
    }

    #[inline]
    fn take(eye: &mut MergingEye) -> Option<[Spectrum; 2]> {
        eye.gathered.take()
    }

    fn depart<M>(
        &self,
        eye: &mut MergingEye,
        way: Segment<'_>,
        vertex: &Vertex<'_, M>,
        bsdf: &SeenBsdf,
    ) {
        let (pdf, is_delta) = (way.departure.pdf, way.departure.is_delta);
        let wi = way.ray.dir;
        let is_specular = is_specular(is_delta, bsdf);
        eye.stage = match eye.stage {
            Stage::Specular if is_specular => Stage::Specular,
            Stage::Specular if self.merges_at(vertex, bsdf) => {
                let cos_out = wi.dot(vertex.interaction.surface.ng).abs();
                Stage::BehindRough {
                    subpath: EyeSubpath::left_rough(pdf, cos_out),
                    n_specular: 0,
                }
            }
            Stage::BehindRough {
                subpath,
                n_specular,
            } if is_specular && n_specular < self.max_specular => Stage::BehindRough {
                subpath: Self::extend(subpath, vertex, wi, pdf, is_delta),
                n_specular: n_specular + 1,
            },
            _ => Stage::Other,
        };
    }

    fn weight_of_hit(
        &self,
        eye: &MergingEye,
        way: Option<Segment<'_>>,
        emitted: &Emitted,
    ) -> Option<f32> {
        let Stage::BehindRough {
            subpath,
            n_specular: 1..,
        } = eye.stage
        else {
            return None;
        };
        let Segment { departure, ray } = way?;
        let d_light = self.d_light(subpath, emitted.light?, ray.origin, ray.dir);
        let connect_pdf = if departure.is_delta { 0.0 } else { emitted.pdf };
        let weight = self
            .gathering
            .merging
            .weight_of_hit(d_light, departure.pdf, connect_pdf);
        Some(weight)
    }

    fn weight_of_connection<M>(
        &self,
        eye: &MergingEye,
        vertex: &Vertex<'_, M>,
        bsdf: &SeenBsdf,
        light: &ChosenLight,
        hit_pdf: f32,
    ) -> Option<f32> {
        let subpath = self.before_specular(eye)?;
        if !is_specular(false, bsdf) {
            return None;
        }
        let sample = &light.sample;
        let subpath = Self::extend(subpath, vertex, sample.wi, sample.pdf, false);
        let d_light = self.d_light(
            subpath,
            light.light,
            vertex.interaction.surface.p,
            sample.wi,
        );
        let weight = self
            .gathering
            .merging
            .weight_of_connection(d_light, hit_pdf, sample.pdf);
        Some(weight)
    }

    fn weight_of_mirrored<M>(
        &self,
        eye: &MergingEye,
        vertex: &Vertex<'_, M>,
        mirror: &Mirror,
        light: Option<u32>,
    ) -> Option<f32> {
        let subpath = self.before_specular(eye)?;
        // There is always a ray, where light that comes the other way draws a lobe.
        let probability = 1.0;
        let surface = &vertex.interaction.surface;
        let subpath = subpath.arrived(surface.wo.dot(surface.ng).abs()).scattered(
            probability,
            mirror.probability,
            mirror.wi.dot(surface.ng).abs(),
        );
        let d_light = self.d_light(subpath, light?, surface.p, mirror.wi);
        let merging = &self.gathering.merging;
        Some(merging.weight_of_connection(d_light, 0.0, probability))
    }
}

/// A unit normal of a surface on the side of `wo`.
pub(super) fn normal_toward(n: Vec3, wo: Vec3) -> Vec3 {
    if n.dot(wo) < 0.0 { -n } else { n }
}
