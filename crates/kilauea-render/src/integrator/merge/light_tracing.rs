//! Light that photons bring straight to the camera, beside hitting and connecting to lights.

use kilauea_bsdf::{BsdfEval, Mirror, SeenBsdf};
use kilauea_math::{Spectrum, Vec3};
use kilauea_scene::CausticStrategy;
use std::future::ready;

use super::{Merge, SharedConnection};
use crate::camera::RayGenerator;
use crate::caustics::Splats;
use crate::geometry::Geometry;
use crate::integrator::guide::{GUIDED_SHARE, Knowledge};
use crate::integrator::path_sample::PathSample;
use crate::integrator::question::{Answer, Question};
use crate::integrator::walk::{Segment, Vertex, power_heuristic};
use crate::light::{ChosenLight, Emitted, Emitter};
use crate::photon::MIN_ROUGHNESS;
use crate::sampler::Sampler;

/// Shares light with photons that the camera sees themselves at its first rough vertex (Dutré et al. 1993,
/// "Monte Carlo light tracing"): without a radius, and so without bias.
#[derive(Clone, Copy)]
pub(crate) struct LightTracing<'a> {
    /// What photons bring to pixels.
    pub(crate) splats: &'a Splats,
    /// Of those that the photons were emitted by.
    pub(crate) emitter: &'a Emitter<'a>,
    pub(crate) geometry: &'a Geometry,
    pub(crate) shares: SplatShares<'a>,
    /// Whether some rays do not meet something.
    pub(crate) has_masks: bool,
}

/// Which light photons share with paths, and how: L P (S|D)* R E, where P is a surface that scatters light of
/// a light in a peak, and R one that has rough lobes.
///
/// Either is weighed by about the balance heuristic, where a path is all that it does, hitting and
/// connecting to lights together. Densities of surfaces between P and R are left out, as what they scatter
/// is about as likely on the way back; so are what guides know and how lights are chosen by what was
/// learnt. So either weight is known from a path alone to who found it, at no cost, and both add up to one.
#[derive(Clone, Copy)]
pub(crate) struct SplatShares<'a> {
    pub(crate) camera: &'a RayGenerator,
    /// Paths of light for each sample of the pixels.
    pub(crate) paths_per_sample: f32,
    pub(crate) found_by: CausticStrategy,
}

/// The first vertex of a camera path: where photons are seen.
#[derive(Clone, Copy)]
pub(crate) struct SeenVertex {
    pub(crate) p: Vec3,
    /// Geometric normal on either side.
    pub(crate) ng: Vec3,
    /// Unit vector to the camera.
    pub(crate) wo: Vec3,
    /// Unit vector to the next vertex.
    pub(crate) wi: Vec3,
    /// Density of that, by its lobes.
    pub(crate) pdf: f32,
}

/// Densities with which a path goes from its last surface to a light.
#[derive(Clone, Copy)]
pub(crate) struct LightPdfs {
    /// By the surface's lobes, or one where it is a mirror.
    pub(crate) pdf: f32,
    /// By choosing the light.
    pub(crate) connect_pdf: f32,
    /// Whether no surface finds the light by itself.
    pub(crate) is_delta: bool,
}

/// Least density of a peak, per solid angle: some ten times that of a diffuse surface. What scatters less is
/// found well enough by paths.
pub(crate) const MIN_PEAK: f32 = 4.0;

impl SplatShares<'_> {
    /// Density of photons over that of paths, at the first vertex.
    #[inline]
    pub(crate) fn at_first(&self, vertex: &SeenVertex) -> f32 {
        let &SeenVertex { p, ng, wo, wi, pdf } = vertex;
        let pixels_per_area = self.camera.pixels_per_area(p, wo) * wo.dot(ng).abs();
        self.paths_per_sample * wi.dot(ng).abs() / (pixels_per_area * pdf)
    }

    /// The same at the last one, where light is emitted along the path with a density; times that at the
    /// first one it is that of the whole.
    #[inline]
    pub(crate) fn at_last(emission_pdf: f32, pdfs: LightPdfs) -> f32 {
        let LightPdfs {
            pdf,
            connect_pdf,
            is_delta,
        } = pdfs;
        let scattered = if is_delta { 0.0 } else { pdf };
        emission_pdf * (pdf / (scattered + connect_pdf))
    }

    /// Weight of a path with that ratio of densities.
    #[inline]
    pub(crate) fn of_path(&self, at_first: f32, at_last: f32) -> f32 {
        let ratio = at_first * at_last;
        // What photons do not find, and what is not a number, is left to paths.
        let is_shared = at_last > 0.0 && ratio > 0.0;
        match self.found_by {
            CausticStrategy::Photons if is_shared => 0.0,
            CausticStrategy::All if is_shared => 1.0 / (1.0 + ratio),
            _ => 1.0,
        }
    }
}

/// What a path keeps of its way since its first vertex.
#[derive(Clone, Copy)]
pub(crate) struct ShownEye {
    /// Density of photons over that of paths, where photons may be seen.
    at_first: Option<f32>,
    /// Density of the direction from a later vertex by its lobes, if that is in a peak.
    peak_pdf: Option<f32>,
}

impl LightTracing<'_> {
    /// The ratio of densities at the first vertex, where the camera sees photons too.
    fn at_first<M>(
        &self,
        way: Segment<'_>,
        vertex: &Vertex<'_, M>,
        bsdf: &SeenBsdf,
    ) -> Option<f32> {
        let surface = &vertex.interaction.surface;
        let (wo, wi, ng) = (surface.wo, way.ray.dir, surface.ng);
        let crosses_medium = vertex.boundary.is_some() && wo.dot(ng) * wi.dot(ng) < 0.0;
        let is_hidden = self.has_masks && vertex.is_hidden_from_photons(self.geometry);
        let is_seen = bsdf.has_rough_lobes(MIN_ROUGHNESS) && !crosses_medium && !is_hidden;
        (is_seen && !way.departure.is_delta).then(|| {
            self.shares.at_first(&SeenVertex {
                p: surface.p,
                ng,
                wo,
                wi,
                pdf: bsdf.eval(wi).pdf,
            })
        })
    }

    /// Share of a light that is left to paths; `p` and the unit vector `wi` toward it are of the ray that
    /// meets it.
    fn weight(&self, at_first: f32, light: u32, p: Vec3, wi: Vec3, pdfs: LightPdfs) -> f32 {
        let emission_pdf = self.emitter.density(light, p, -wi);
        let at_last = SplatShares::at_last(emission_pdf, pdfs);
        self.shares.of_path(at_first, at_last)
    }
}

impl Merge for LightTracing<'_> {
    type Eye = ShownEye;
    type Asked<R, K> = ();

    fn start(&self) -> ShownEye {
        ShownEye {
            at_first: None,
            peak_pdf: None,
        }
    }

    #[inline]
    fn show(&self, pixel: [i32; 2], sample_idx: u32, out: &mut PathSample) {
        for splat in self.splats.of_sample(pixel, sample_idx) {
            out.indirect_diffuse += splat.diffuse.unpack();
            out.indirect_specular += splat.specular.unpack();
        }
    }

    #[inline(always)]
    fn gather<M, R, K: Knowledge>(
        &self,
        _: &mut ShownEye,
        _: &Vertex<'_, M>,
        _: (&SeenBsdf, &K),
        _: impl FnOnce(Question) -> R,
        (): &mut (),
    ) -> bool {
        false
    }

    #[inline(always)]
    fn receive<R, K: Knowledge>(&self, _: &mut ShownEye, (): &mut ()) -> impl Future<Output = ()>
    where
        R: Future<Output = Answer> + Unpin,
    {
        ready(())
    }

    #[inline(always)]
    fn take(_: &mut ShownEye) -> Option<[Spectrum; 2]> {
        None
    }

    #[inline]
    fn depart<M>(
        &self,
        eye: &mut ShownEye,
        way: Segment<'_>,
        vertex: &Vertex<'_, M>,
        [bsdf, _]: [&SeenBsdf; 2],
        _: &Sampler<'_>,
    ) -> [Spectrum; 2] {
        /// No direction of a peak has less of a density that guides have a share in.
        const MIN_GUIDED: f32 = MIN_PEAK * (1.0 - GUIDED_SHARE);
        let departure = way.departure;
        eye.peak_pdf = None;
        if vertex.depth == 0 {
            eye.at_first = self.at_first(way, vertex, bsdf);
        } else if eye.at_first.is_some() {
            eye.peak_pdf = if departure.is_delta {
                Some(1.0)
            } else if departure.pdf >= MIN_GUIDED {
                Some(bsdf.eval(way.ray.dir).pdf).filter(|&pdf| pdf >= MIN_PEAK)
            } else {
                None
            };
        }
        [Spectrum::ONE; 2]
    }

    fn weight_of_hit(
        &self,
        eye: &ShownEye,
        way: Option<Segment<'_>>,
        emitted: &Emitted,
        distance: f32,
    ) -> Option<f32> {
        let (at_first, pdf) = (eye.at_first?, eye.peak_pdf?);
        let way = way?;
        let light = emitted.light?;
        let connect_pdf = way.connect_pdf(self.emitter, light, distance);
        let beside_connecting = way.weight_beside_connecting(way.departure.pdf, emitted.pdf);
        let pdfs = LightPdfs {
            pdf,
            connect_pdf,
            is_delta: false,
        };
        let weight = self.weight(at_first, light, way.ray.origin, way.ray.dir, pdfs);
        Some(weight * beside_connecting)
    }

    #[inline]
    fn weight_of_connection<M>(
        &self,
        eye: &ShownEye,
        vertex: &Vertex<'_, M>,
        (_, eval): (&SeenBsdf, &BsdfEval),
        light: &ChosenLight,
        hit_pdf: f32,
    ) -> Option<SharedConnection> {
        let at_first = eye.at_first.filter(|_| eval.pdf >= MIN_PEAK)?;
        let sample = &light.sample;
        let (p, wi) = (vertex.interaction.surface.p, sample.wi);
        let receiver = vertex.receiver();
        let pdfs = LightPdfs {
            pdf: eval.pdf,
            connect_pdf: (self.emitter).connection_pdf(light.light, receiver, wi, sample.distance),
            is_delta: sample.is_delta,
        };
        let weight = self.weight(at_first, light.light, p, wi, pdfs);
        Some(SharedConnection {
            diffuse: eval.diffuse,
            specular: eval.specular,
            weight: weight * power_heuristic(sample.pdf, hit_pdf),
        })
    }

    fn weight_of_mirrored<M>(
        &self,
        eye: &ShownEye,
        vertex: &Vertex<'_, M>,
        mirror: &Mirror,
        light: Option<u32>,
    ) -> Option<f32> {
        let pdfs = LightPdfs {
            pdf: 1.0,
            connect_pdf: 0.0,
            is_delta: false,
        };
        let p = vertex.interaction.surface.p;
        Some(self.weight(eye.at_first?, light?, p, mirror.wi, pdfs))
    }
}
