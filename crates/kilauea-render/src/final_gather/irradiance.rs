//! Irradiance all over a scene, from photons.

use std::num::NonZeroUsize;
use std::time::Instant;

use kilauea_math::hash::combine;
use kilauea_photon::{DensityRule, Kernel, Photon, PhotonMap, RadianceCache, RadiusRule};

use crate::RenderError;
use crate::frame::Frame;
use crate::integrator::{FinalGather, Merge};
use crate::light::Emitter;
use crate::photon::{PhotonRequest, TracedPhotons, trace_irradiance};

/// What diffuse lobes receive, at some of the places where photons arrived.
pub(crate) struct IrradianceCache {
    cache: RadianceCache,
    /// How far photons of a record are at most, engine space.
    max_radius: f32,
    /// Rays of the photons.
    pub(super) n_rays: u64,
}

/// Paths of light that are traced together: what they leave is one message between those who render
/// the frame.
const BATCH: u32 = 1 << 17;
/// Photons of which a record is.
const N_NEAREST: NonZeroUsize = NonZeroUsize::new(50).expect("not zero");
/// Photons for each of which there is a record.
const PHOTONS_PER_RECORD: NonZeroUsize = NonZeroUsize::new(4).expect("not zero");
/// Which photons count for a record. Stricter than for pictures of photons: the inside of a lamp or of
/// a cupboard may lie a little behind what is seen, and be much brighter or darker.
pub(super) const ON_ONE_SURFACE: DensityRule = DensityRule {
    kernel: Kernel::Epanechnikov,
    min_cos_normals: 0.9,
    max_plane_distance: 0.03,
};
/// Farthest that photons of a record are, over where they would be if all were spread evenly over a
/// convex scene: where light is dimmer, paths find it better.
const MAX_SPREAD: f32 = 4.0;

impl IrradianceCache {
    /// Of the photons of so many paths that leave lights; none where there are no photons.
    pub(super) fn trace(
        frame: &Frame,
        emitter: &Emitter<'_>,
        n_emitted: u32,
        seed: u32,
    ) -> Result<Option<Self>, RenderError> {
        let n_batches = n_emitted.div_ceil(BATCH);
        let (mut photons, mut n_rays) = (Vec::new(), 0);
        for batch in 0..n_batches {
            let traced = trace_batch(frame, emitter, n_emitted / n_batches, combine(seed, batch))?;
            let of_all = |photon: Photon| Photon {
                power: photon.power / n_batches as f32,
                ..photon
            };
            n_rays += traced.counts.rays;
            photons.extend(traced.photons.into_iter().map(of_all));
        }
        let start = Instant::now();
        let map = PhotonMap::build(&photons);
        let max_radius = farthest_of_record(emitter, map.len());
        let radius = RadiusRule::Nearest {
            k: N_NEAREST,
            max_radius,
        };
        let cache = RadianceCache::build(&map, PHOTONS_PER_RECORD, radius, &ON_ONE_SURFACE);
        let mut outcome = frame.lock_outcome();
        let caustics = &mut outcome.caustics;
        caustics.seconds += start.elapsed().as_secs_f64();
        caustics.bytes_peak = caustics
            .bytes_peak
            .max((map.bytes() + cache.bytes()) as u64);
        let found = &mut outcome.final_gather;
        found.photons = map.len() as u64;
        found.records = cache.len() as u64;
        found.bytes = cache.bytes() as u64;
        Ok((!cache.is_empty()).then_some(Self {
            cache,
            max_radius,
            n_rays,
        }))
    }

    /// What paths need of it that share photons by `merge` as well.
    pub(crate) fn gather<'s, X: Merge>(&'s self, frame: &'s Frame, merge: X) -> FinalGather<'s, X> {
        FinalGather {
            cache: &self.cache,
            geometry: &frame.prepared.geometry,
            max_radius: self.max_radius,
            merge,
        }
    }
}

fn trace_batch(
    frame: &Frame,
    emitter: &Emitter<'_>,
    n_emitted: u32,
    seed: u32,
) -> Result<TracedPhotons, RenderError> {
    let request = frame.irradiance_request(n_emitted, seed);
    let traced = trace_irradiance(&frame.prepared, emitter, &request, frame.path_share())?;
    frame.note_irradiance(&traced);
    Ok(traced)
}

impl Frame {
    /// So many paths of light whose photons are irradiance.
    pub(super) fn irradiance_request(&self, n_emitted: u32, seed: u32) -> PhotonRequest {
        let settings = &self.settings;
        PhotonRequest {
            n_emitted,
            // With the vertex that looks up and the one before, light is scattered as often as
            // paths scatter it.
            max_depth: settings.max_depth - 1,
            seed: combine(settings.seed, seed),
            n_threads: self.n_threads,
            shading: settings.shading,
        }
    }

    /// Counts paths of light.
    pub(super) fn note_irradiance(&self, traced: &TracedPhotons) {
        let mut outcome = self.lock_outcome();
        outcome.add_photons(traced);
        outcome.final_gather.emitted += traced.counts.emitted;
    }
}

/// How far photons of a record are at most, where there are so many in a scene.
pub(super) fn farthest_of_record(emitter: &Emitter<'_>, n_photons: usize) -> f32 {
    // By Cauchy, what is convex has four times the area of its mean shadow.
    let area = 4.0 * emitter.mean_cross_section();
    let disc = area * N_NEAREST.get() as f32 / n_photons.max(1) as f32;
    MAX_SPREAD * (disc / std::f32::consts::PI).sqrt()
}
