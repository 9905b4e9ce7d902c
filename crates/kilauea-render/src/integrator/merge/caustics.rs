//! Caustics by merging, beside hitting and connecting to lights.

use kilauea_bsdf::{BsdfEval, Mirror, SeenBsdf};
use kilauea_math::hash::unit_f32;
use kilauea_math::{Spectrum, Vec3};
use kilauea_photon::{EyeSubpath, SurfaceQuery};
use std::mem::take;

use super::source::{Gathering, Lookup, PhotonSource};
use super::{Merge, SharedConnection};
use crate::geometry::Geometry;
use crate::integrator::guide::Knowledge;
use crate::integrator::question::{Answer, Question};
use crate::integrator::walk::{Segment, Vertex, power_heuristic};
use crate::light::{ChosenLight, Emitted, Emitter};
use crate::photon::{DrawnLobes, LOBES_KEY, MIN_ROUGHNESS, adjoint_pdf};
use crate::sampler::Sampler;

/// Merges at each rough vertex with photons that came over specular surfaces alone: L S⁺ D (S|D)* E.
///
/// Each such path is weighed against the other ways to find it, hitting and connecting together, by the balance
/// heuristic (`kilauea_photon::Merging`), and these by the power heuristic as ever. How lights are chosen by what
/// was learnt is in the latter alone, as photons do not know it. S is what narrow lobes scatter, D what
/// others do ([`DrawnLobes`]).
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
    /// The way since the last rough vertex, if photons find what the path meets.
    behind: Option<BehindRough>,
    /// Whether photons are looked for where the path is.
    has_merged: bool,
    /// Light of photons, scattered by diffuse lobes and by all others.
    gathered: Option<[Spectrum; 2]>,
}

/// The way since a vertex where the path merged: S*D.
#[derive(Clone, Copy)]
struct BehindRough {
    subpath: EyeSubpath,
    n_specular: u32,
    /// Density of the last direction.
    pdf: f32,
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
            && bsdf.has_rough_lobes(MIN_ROUGHNESS)
            && !(self.has_masks && vertex.is_hidden_from_photons(self.geometry))
    }

    /// The way since a rough vertex, where one more specular surface is not too many for photons.
    fn before_specular(&self, eye: &MergingEye) -> Option<BehindRough> {
        eye.behind
            .filter(|behind| behind.n_specular < self.max_specular)
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
            behind: None,
            has_merged: false,
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
        if !self.merges_at(vertex, bsdf) {
            return false;
        }
        eye.has_merged = true;
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
        lobes: [&SeenBsdf; 2],
        sampler: &Sampler<'_>,
    ) -> [Spectrum; 2] {
        let has_merged = take(&mut eye.has_merged);
        let before = self.before_specular(eye);
        eye.behind = None;
        if !has_merged && before.is_none() {
            return [Spectrum::ONE; 2];
        }
        let (pdf, is_delta) = (way.departure.pdf, way.departure.is_delta);
        let wi = way.ray.dir;
        let u = || unit_f32(sampler.key(LOBES_KEY | vertex.depth));
        let drawn = DrawnLobes::draw_at((wi, is_delta), lobes, u);
        eye.behind = if drawn.are_narrow {
            before.map(|behind| BehindRough {
                subpath: Self::extend(behind.subpath, vertex, wi, pdf, is_delta),
                n_specular: behind.n_specular + 1,
                pdf,
            })
        } else {
            let cos_out = wi.dot(vertex.interaction.surface.ng).abs();
            has_merged.then(|| BehindRough {
                subpath: EyeSubpath::left_rough(pdf, cos_out),
                n_specular: 0,
                pdf,
            })
        };
        drawn.shares
    }

    fn weight_of_hit(
        &self,
        eye: &MergingEye,
        way: Option<Segment<'_>>,
        emitted: &Emitted,
        distance: f32,
    ) -> Option<f32> {
        let BehindRough { subpath, pdf, .. } = eye.behind.filter(|b| b.n_specular > 0)?;
        let way = way?;
        let light = emitted.light?;
        let connect_pdf = way.connect_pdf(self.emitter, light, distance);
        let beside_connecting = way.weight_beside_connecting(pdf, emitted.pdf);
        let d_light = self.d_light(subpath, light, way.ray.origin, way.ray.dir);
        let of_both = pdf / (pdf + connect_pdf);
        let merging = &self.gathering.merging;
        Some(merging.weight_of_eye(d_light * of_both) * beside_connecting)
    }

    fn weight_of_connection<M>(
        &self,
        eye: &MergingEye,
        vertex: &Vertex<'_, M>,
        (bsdf, _): (&SeenBsdf, &BsdfEval),
        light: &ChosenLight,
        hit_pdf: f32,
    ) -> Option<SharedConnection> {
        let behind = self.before_specular(eye)?;
        if !bsdf.has_narrow_lobes(MIN_ROUGHNESS) {
            return None;
        }
        let sample = &light.sample;
        let (p, wi) = (vertex.interaction.surface.p, sample.wi);
        let (receiver, distance) = (vertex.receiver(), sample.distance);
        let connect_pdf = (self.emitter).connection_pdf(light.light, receiver, wi, distance);
        let of_both = hit_pdf + connect_pdf;
        let subpath = Self::extend(behind.subpath, vertex, wi, of_both, false);
        let d_light = self.d_light(subpath, light.light, p, wi);
        let merging = &self.gathering.merging;
        Some(SharedConnection {
            diffuse: Spectrum::BLACK,
            specular: bsdf.eval_narrow(wi, MIN_ROUGHNESS),
            weight: merging.weight_of_eye(d_light) * power_heuristic(sample.pdf, hit_pdf),
        })
    }

    fn weight_of_mirrored<M>(
        &self,
        eye: &MergingEye,
        vertex: &Vertex<'_, M>,
        mirror: &Mirror,
        light: Option<u32>,
    ) -> Option<f32> {
        let subpath = self.before_specular(eye)?.subpath;
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
        Some(merging.weight_of_eye(d_light))
    }
}

/// A unit normal of a surface on the side of `wo`.
pub(super) fn normal_toward(n: Vec3, wo: Vec3) -> Vec3 {
    if n.dot(wo) < 0.0 { -n } else { n }
}
