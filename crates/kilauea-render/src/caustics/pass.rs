//! The photons of a pass of samples.

use std::sync::Arc;
use std::time::Instant;

use kilauea_math::hash::combine;
use kilauea_photon::{Kernel, LightUnit, Merging, PhotonMap};
use kilauea_scene::CausticStrategy;

use super::plan::CausticPlan;
use crate::RenderError;
use crate::frame::Frame;
use crate::integrator::{CausticMerge, Gathering, PhotonSource, PhotonsOfSet};
use crate::photon::{DividedPaths, PhotonRequest, TracedPhotons, trace_caustic_photons};
use crate::set::{PassParts, Set};
use crate::share::PathShare;

/// What the samples of a pass merge with.
pub(crate) struct CausticPass<'a> {
    plan: &'a CausticPlan<'a>,
    frame: &'a Frame,
    pass: u32,
    /// None where the photons are divided among the members of a set.
    map: Option<PhotonMap>,
    gathering: Gathering,
}

/// Where the photons of a pass are.
pub(crate) enum CausticSource<'a> {
    /// In one map.
    Here(&'a PhotonMap),
    /// With the members of a set.
    OfSet(PhotonsOfSet<'a>),
}

/// Most paths of light for a pass, for the sake of memory.
const MAX_EMITTED: u32 = 1 << 22;

/// Paths of light for a pass of so many samples.
pub(super) fn n_emitted(n_per_sample: u32, n_samples: u32) -> u32 {
    n_per_sample.saturating_mul(n_samples).min(MAX_EMITTED)
}

impl CausticPlan<'_> {
    /// Paths of light for a pass. A pass of twice the samples gets twice the photons, so that all
    /// samples count the same.
    pub(super) fn n_emitted(&self, frame: &Frame, pass: u32) -> u32 {
        let n_samples = frame.passes.samples(&(pass..pass + 1)).len() as u32;
        n_emitted(self.n_per_sample, n_samples)
    }

    /// What to trace for a pass, over so many surfaces.
    pub(super) fn pass_request(&self, frame: &Frame, pass: u32, max_depth: u32) -> PhotonRequest {
        let first_sample = frame.passes.samples(&(pass..pass + 1)).start;
        PhotonRequest {
            n_emitted: self.n_emitted(frame, pass),
            max_depth,
            seed: combine(frame.settings.seed, first_sample),
            n_threads: frame.n_threads,
            shading: frame.settings.shading,
        }
    }

    /// Traces the photons of a pass; its radius is that of its first sample.
    pub(crate) fn trace<'s>(
        &'s self,
        frame: &'s Frame,
        pass: u32,
    ) -> Result<CausticPass<'s>, RenderError> {
        let first_sample = frame.passes.samples(&(pass..pass + 1)).start;
        let settings = &frame.settings;
        let request = self.pass_request(frame, pass, self.max_specular + 1);
        let n_emitted = request.n_emitted;
        let set = (frame.prepared.set.as_ref()).filter(|_| self.divides(frame, pass));
        let share = frame.path_share();
        let divided = share.map(DividedPaths);
        let share = match (&divided, set) {
            (Some(divided), Some(_)) => Some(divided as &dyn PathShare),
            _ => share,
        };
        let traced = trace_caustic_photons(&frame.prepared, &self.emitter, &request, share)?;
        let start = Instant::now();
        let radius = self.radius(first_sample);
        let brightest = traced.brightest;
        let (map, n_stored, n_bytes) = match set {
            None => {
                let map = PhotonMap::build(&traced.photons);
                let (n_stored, n_bytes) = (map.len(), map.bytes());
                (Some(map), n_stored, n_bytes)
            }
            Some(set) => {
                let maps = part_maps(set, &traced);
                // Also of those that are elsewhere.
                let n_stored = traced.counts.stored_caustic as usize;
                let n_bytes = maps.iter().flatten().map(PhotonMap::bytes).sum();
                // Where the frame is over not all is known, and nobody may take it for all.
                if traced.counts.emitted == u64::from(n_emitted) {
                    frame.photons.add(PassParts { pass, radius, maps });
                }
                (None, n_stored, n_bytes)
            }
        };
        let mut outcome = frame.lock_outcome();
        outcome.add_photons(&traced);
        let caustics = &mut outcome.caustics;
        caustics.emitted += traced.counts.emitted;
        caustics.stored += n_stored as u64;
        caustics.bytes_peak = caustics.bytes_peak.max(n_bytes as u64);
        if pass == 0 {
            caustics.first_radius = radius;
        }
        caustics.last_radius = radius;
        caustics.seconds += start.elapsed().as_secs_f64();
        drop(outcome);
        Ok(CausticPass {
            plan: self,
            frame,
            pass,
            map,
            gathering: Gathering {
                merging: merging(settings.photons.found_by, n_emitted, radius),
                radius,
                unit: LightUnit::of(brightest, Kernel::default(), radius),
            },
        })
    }
}

/// The parts of a map that members in this process have, by member.
fn part_maps(set: &Set, traced: &TracedPhotons) -> Arc<[Option<PhotonMap>]> {
    let maps = set.photon_parts().map(|part| {
        let part = part?;
        let own: Vec<_> = (traced.photons.iter().copied())
            .filter(|photon| part.has(photon))
            .collect();
        Some(PhotonMap::build_part(&own, traced.brightest))
    });
    maps.collect()
}

fn merging(found_by: CausticStrategy, n_emitted: u32, radius: f32) -> Merging {
    match found_by {
        CausticStrategy::All => Merging::new(n_emitted.into(), radius, 0.0),
        CausticStrategy::Photons => Merging::alone(),
        CausticStrategy::Paths => Merging::never(),
    }
}

impl CausticPass<'_> {
    /// Where its photons are.
    pub(crate) fn source(&self) -> CausticSource<'_> {
        match &self.map {
            Some(map) => CausticSource::Here(map),
            None => CausticSource::OfSet(PhotonsOfSet {
                pass: self.pass,
                lost: &self.frame.lost_photons,
            }),
        }
    }

    /// What paths need of it.
    pub(crate) fn merge<S: PhotonSource>(&self, source: S) -> CausticMerge<'_, S> {
        let frame = self.frame;
        let max_depth = frame.settings.max_depth;
        CausticMerge {
            source,
            emitter: &self.plan.emitter,
            geometry: &frame.prepared.geometry,
            gathering: self.gathering,
            max_specular: self.plan.max_specular,
            max_depth: max_depth - 1 - self.plan.max_specular,
            has_masks: frame.prepared.needs.masks,
        }
    }
}
