//! What is told of a frame once rendering has stopped.

use std::collections::BTreeSet;
use std::sync::PoisonError;

use crate::RenderError;
use crate::frame::Frame;
use crate::integrator::RayCounts;
use crate::job::RenderResult;
use crate::needs::SceneNeeds;
use crate::set::Set;
use crate::stats::{Memory, Rays, RenderStats, SceneSize, Textures, Times, peak_rss_bytes};

impl Frame {
    /// What was rendered, once rendering has stopped.
    pub(crate) fn into_result(self) -> Result<RenderResult, RenderError> {
        let (pixels_stopped, is_clean) = (self.n_pixels_stopped(), self.is_clean());
        let outcome = self
            .outcome
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        if let Some(error) = outcome.error {
            return Err(error);
        }
        let prepared = &*self.prepared;
        let full_passes = self.passes.n_done();
        let (needs, skipped) = SceneNeeds {
            guided_directions: self.needs.guided_directions || outcome.learnt.directions.is_some(),
            guided_lights: self.needs.guided_lights || outcome.learnt.knows_lights(),
            ..self.needs
        }
        .names();
        let scene = &prepared.scene;
        let beside = prepared
            .set
            .as_ref()
            .map(Set::bytes_beside)
            .unwrap_or_default();
        let tiles = prepared.textures.stats();
        let samples = self.film.n_samples();
        let mut warnings = prepared.warnings.clone();
        let of_members = prepared.set.iter().flat_map(Set::take_texture_errors);
        let errors = prepared.textures.take_errors().into_iter();
        let errors = errors.chain(of_members).map(|error| error.to_string());
        // Members open the same files.
        warnings.extend(errors.collect::<BTreeSet<_>>());
        warnings.extend(count_warnings(outcome.counts));
        let geometry = &prepared.geometry;
        warnings.extend(outcome.faults.named(|at| geometry.name(at)).lines());
        let stats = RenderStats {
            samples_per_pixel: samples as f64 / self.n_pixels.max(1) as f64,
            samples,
            pixels_stopped,
            invalid_samples: self.film.n_invalid(),
            invalid_samples_by_step: outcome.faults.counts(),
            invalid_rays: outcome.counts.invalid,
            times: Times {
                build: prepared.build_secs,
                photon: outcome.caustics.seconds,
                gather: outcome.gather_secs,
                render: outcome.render_secs,
                ..Times::default()
            },
            rays: Rays {
                photon: outcome.caustics.rays,
                ..outcome.counts.into()
            },
            memory: Memory {
                peak_rss: peak_rss_bytes(),
                scene: scene.n_bytes() as u64 + beside.scene,
                accel: prepared.geometry.accel().n_bytes() as u64 + beside.accel,
                lights: prepared.lights.n_bytes() as u64,
                film: self.film.n_bytes(),
                photons: outcome.caustics.bytes_peak,
                shades_in_flight_peak: outcome.shades.peak_bytes(),
                texture_tiles_peak: tiles.bytes_peak,
            },
            shades: outcome.shades.stats(),
            photons: outcome.caustics,
            gather: outcome.learnt.found,
            aim: outcome.aim,
            final_gather: outcome.final_gather,
            textures: Textures {
                tiles_total: tiles.tiles_total,
                tiles_loaded: tiles.tiles_loaded,
                tiles_fetched: tiles.tiles_fetched,
                seconds_waited: tiles.lookup_wait.as_secs_f64(),
                bytes_read: tiles.bytes_read,
                values_replaced: tiles.values_replaced,
            },
            scene: SceneSize {
                placements: prepared.geometry.n_placements() as u64,
                lights: prepared.lights.len() as u64,
                ..prepared.size
            },
            set: self.traffic.stats(prepared, &self.photons),
            shared_passes: Vec::new(),
            needs,
            skipped,
            is_complete: full_passes == self.passes.n_passes() || is_clean,
            full_passes,
            warnings,
        };
        Ok(RenderResult {
            film: self.film,
            stats,
        })
    }
}

/// What users should know of what happened to rays.
pub(crate) fn count_warnings(counts: RayCounts) -> Vec<String> {
    let invalid = (counts.invalid > 0).then(|| {
        let n = counts.invalid;
        format!("{n} rays could not be traced and hit nothing")
    });
    let crowded = (counts.in_too_many_media > 0).then(|| {
        let n = counts.in_too_many_media;
        format!(
            "{n} paths were in too many media at once; those of the lowest priority were forgotten"
        )
    });
    invalid.into_iter().chain(crowded).collect()
}
