//! Paths that leave records of the light that they found.

use kilauea_bsdf::{BsdfSample, SeenBsdf};
use kilauea_gather::GatherRecord;
use kilauea_math::{Spectrum, Vec3};

use super::guided::{Guided, Known};
use super::unguided::Unguided;
use super::{Guide, Knowledge, Roulette};
use crate::integrator::{PathSample, RayTally};
use crate::light::Receiver;

/// Guides by what earlier paths found, if there were any, and notes what paths find.
#[derive(Clone, Copy)]
pub(crate) struct Training<'a> {
    pub(crate) guide: Option<Guided<'a>>,
}

/// A path's vertices, until it is known what light they received.
#[derive(Debug, Default)]
pub(crate) struct PathTrail {
    /// As a guided path keeps it.
    importance: f32,
    /// Scattering whose vertex has not added its own light yet.
    pending: Option<TrailVertex>,
    vertices: Vec<TrailVertex>,
}

#[derive(Clone, Copy, Debug)]
struct TrailVertex {
    receiver: Receiver,
    /// Direction and density; none where the path ended or was mirrored.
    direction: Option<(Vec3, f32)>,
    /// Fraction of light that arrives at the camera from here.
    arriving: Spectrum,
    /// The same of light that arrives here along the direction.
    throughput: Spectrum,
    albedo: Spectrum,
    /// Light of the sample, and rays traced for it, before the path went on.
    gathered: Spectrum,
    n_rays: u64,
}

impl<'a> Guide for Training<'a> {
    type Knowledge = Option<Known<'a>>;
    type Trail = PathTrail;

    fn begin(&self, trail: &mut PathTrail, pixel: [i32; 2]) {
        if let Some(guide) = &self.guide {
            guide.begin(&mut trail.importance, pixel);
        }
    }

    #[inline]
    fn at(&self, trail: &PathTrail, receiver: Receiver) -> Self::Knowledge {
        self.guide
            .map(|guide| guide.at(&trail.importance, receiver))
    }

    fn leave(
        trail: &mut PathTrail,
        receiver: Receiver,
        bsdf: &SeenBsdf,
        sample: Option<&BsdfSample>,
        arriving: Spectrum,
    ) {
        if !bsdf.has_smooth_lobes() {
            return;
        }
        trail.pending = Some(TrailVertex {
            receiver,
            direction: sample.filter(|s| !s.is_delta).map(|s| (s.wi, s.pdf)),
            arriving,
            throughput: arriving * sample.map_or(Spectrum::BLACK, BsdfSample::weight),
            albedo: bsdf.albedo(),
            gathered: Spectrum::BLACK,
            n_rays: 0,
        });
    }

    fn depart(trail: &mut PathTrail, out: &PathSample, counts: &RayTally) {
        if let Some(vertex) = trail.pending.take() {
            trail.vertices.push(TrailVertex {
                gathered: out.light(),
                n_rays: n_rays(counts),
                ..vertex
            });
        }
    }
}

impl PathTrail {
    /// Ends the path: adds what its vertices learnt to `records`.
    pub(crate) fn end(
        &mut self,
        out: &PathSample,
        counts: &RayTally,
        records: &mut Vec<GatherRecord>,
    ) {
        let (light, n_rays) = (out.light(), n_rays(counts));
        records.extend(self.vertices.drain(..).map(|vertex| {
            let found = light - vertex.gathered;
            let Receiver { p, n } = vertex.receiver;
            let (wi, pdf) = vertex.direction.unwrap_or((n, 1.0));
            let irradiance = if vertex.direction.is_some() && !vertex.throughput.is_black() {
                let incident = found.luminance() / vertex.throughput.luminance();
                (incident * wi.dot(n).abs() / pdf).max(0.0)
            } else {
                0.0
            };
            GatherRecord {
                p,
                n,
                wi,
                irradiance,
                pdf,
                radiance: per(found, vertex.arriving * vertex.albedo),
                n_rays: (n_rays - vertex.n_rays) as f32,
            }
        }));
    }
}

impl Knowledge for Option<Known<'_>> {
    #[inline]
    fn chooses_directions(&self) -> bool {
        self.is_some_and(|known| known.chooses_directions())
    }

    #[inline]
    fn sample(&self, bsdf: &SeenBsdf, u: [f32; 3]) -> Option<BsdfSample> {
        match self {
            Some(known) => known.sample(bsdf, u),
            None => Unguided.sample(bsdf, u),
        }
    }

    #[inline]
    fn pdf(&self, bsdf: &SeenBsdf, wi: Vec3, bsdf_pdf: f32) -> f32 {
        match self {
            Some(known) => known.pdf(bsdf, wi, bsdf_pdf),
            None => Unguided.pdf(bsdf, wi, bsdf_pdf),
        }
    }

    #[inline]
    fn roulette(
        &self,
        depth: u32,
        bsdf: &SeenBsdf,
        arriving: Spectrum,
        throughput: Spectrum,
    ) -> Option<Roulette> {
        match self {
            Some(known) => known.roulette(depth, bsdf, arriving, throughput),
            None => Unguided.roulette(depth, bsdf, arriving, throughput),
        }
    }
}

pub(crate) fn n_rays(counts: &RayTally) -> u64 {
    u64::from(counts.shadow) + u64::from(counts.indirect)
}

/// Light per share, channel by channel; none where there is no share.
fn per(light: Spectrum, share: Spectrum) -> Spectrum {
    let (light, share) = (light.to_array(), share.to_array());
    Spectrum::from(std::array::from_fn(|c| {
        if share[c] > 0.0 {
            light[c] / share[c]
        } else {
            0.0
        }
    }))
}
