//! The photons of a pass of samples.

use std::time::Instant;

use kilauea_math::hash::combine;
use kilauea_photon::{Merging, PhotonMap};
use kilauea_scene::CausticStrategy;

use super::plan::CausticPlan;
use crate::RenderError;
use crate::frame::Frame;
use crate::integrator::CausticMerge;
use crate::photon::{PhotonRequest, trace_caustic_photons};

/// What the samples of a pass merge with.
pub(crate) struct CausticPass<'a> {
    plan: &'a CausticPlan<'a>,
    map: PhotonMap,
    merging: Merging,
    radius: f32,
}

/// Most paths of light for a pass, for the sake of memory.
const MAX_EMITTED: u32 = 1 << 22;

impl CausticPlan<'_> {
    /// Traces the photons of a pass. A pass of twice the samples gets twice the photons, so that all
    /// samples count the same; its radius is that of its first one.
    pub(crate) fn trace(&self, frame: &Frame, pass: u32) -> Result<CausticPass<'_>, RenderError> {
        let samples = frame.passes.samples(&(pass..pass + 1));
        let n_samples = samples.len() as u32;
        let n_emitted = self.n_per_sample.saturating_mul(n_samples).min(MAX_EMITTED);
        let settings = &frame.settings;
        let request = PhotonRequest {
            n_emitted,
            max_depth: self.max_specular + 1,
            seed: combine(settings.seed, samples.start),
            n_threads: frame.n_threads,
            shading: settings.shading,
        };
        let traced =
            trace_caustic_photons(&frame.prepared, &self.emitter, &request, frame.path_share())?;
        let start = Instant::now();
        let map = PhotonMap::build(&traced.photons);
        let map_secs = start.elapsed().as_secs_f64();
        let radius = self.radius(samples.start);
        let mut outcome = frame.lock_outcome();
        outcome.add_photons(&traced);
        let caustics = &mut outcome.caustics;
        caustics.emitted += traced.counts.emitted;
        caustics.stored += map.len() as u64;
        caustics.bytes_peak = caustics.bytes_peak.max(map.bytes() as u64);
        if pass == 0 {
            caustics.first_radius = radius;
        }
        caustics.last_radius = radius;
        caustics.seconds += map_secs;
        Ok(CausticPass {
            plan: self,
            merging: merging(settings.photons.found_by, n_emitted, radius),
            map,
            radius,
        })
    }
}

fn merging(found_by: CausticStrategy, n_emitted: u32, radius: f32) -> Merging {
    match found_by {
        CausticStrategy::All => Merging::new(n_emitted.into(), radius, 0.0),
        CausticStrategy::Photons => Merging::alone(),
        CausticStrategy::Paths => Merging::never(),
    }
}

impl CausticPass<'_> {
    /// What paths need of it.
    pub(crate) fn merge<'s>(&'s self, frame: &'s Frame) -> CausticMerge<'s> {
        let max_depth = frame.settings.max_depth;
        CausticMerge {
            map: &self.map,
            emitter: &self.plan.emitter,
            geometry: &frame.prepared.geometry,
            merging: self.merging,
            radius: self.radius,
            max_specular: self.plan.max_specular,
            max_depth: max_depth - 1 - self.plan.max_specular,
            has_masks: frame.prepared.needs.masks,
        }
    }
}
