//! What photons of a frame are traced.

use kilauea_math::hash::combine;
use kilauea_photon::ProgressiveRadius;
use kilauea_scene::{Camera, CausticStrategy, GlobalIllumination, RenderSettings, Scene};

use super::radius::{CausticLight, first_radius};
use crate::RenderError;
use crate::frame::Frame;
use crate::light::{Emitter, UsefulRay};
use crate::needs::moves;
use crate::photon::{
    IMPORTON_BLOCK, N_PILOT, PhotonRequest, Pilot, pilot, trace_caustic_photons,
    trace_photons_shared,
};

/// How a frame's caustics are found by photons.
pub(crate) struct CausticPlan<'a> {
    pub(super) emitter: Emitter<'a>,
    /// Paths that lights send out for each sample of the pixels.
    pub(super) n_per_sample: u32,
    /// Of the first sample, engine space.
    pub(super) first_radius: f32,
    /// Specular surfaces that photons meet at most.
    pub(super) max_specular: u32,
    /// Photons that a path leaves, in the mean.
    pub(super) kept_per_path: f64,
}

/// Samples of pixels for each path that lights send out: measured, see decision 022.
const SAMPLES_PER_PATH: u32 = 8;
/// A frame of few photons aims by one in so many more.
const PILOT_SHARE: u32 = 8;
/// A frame for which the camera would see photons of fewer paths goes without.
const LEAST_EMITTED: u32 = 4096;
/// Variance of a sample of a pixel, relative to the square of the mean luminance, that photons have to take to be
/// used: measured, see decisions 022 and 032.
const LEAST_GAIN: f64 = 0.3;
/// Apart from the numbers of all samples, whose photons have seeds by them.
const AIMED_PILOT: u32 = u32::MAX;

impl<'a> CausticPlan<'a> {
    /// The plan for a frame; none where photons do not pay, for a reason that is in the frame's
    /// statistics then.
    pub(crate) fn of(frame: &'a Frame) -> Result<Option<Self>, RenderError> {
        let planned = Self::plan(frame)?;
        let mut outcome = frame.lock_outcome();
        Ok(match planned {
            Ok(plan) => Some(plan),
            Err(reasons) => {
                outcome.caustics.skipped = reasons;
                None
            }
        })
    }

    /// A plan, or the reasons why there is none.
    fn plan(frame: &'a Frame) -> Result<Result<Self, Vec<String>>, RenderError> {
        let Frame {
            prepared, settings, ..
        } = frame;
        if is_left_to_paths(settings) {
            return Ok(Err(Vec::new()));
        }
        let skip = |reason: &str| Ok(Err(vec![format!("caustic photons: {reason}")]));
        let emitter = Emitter::new(&prepared.lights, &prepared.geometry, &prepared.textures);
        if emitter.is_empty() {
            return skip("no light sends any out");
        }
        if let Some(reason) = why_no_photons(&prepared.scene, &prepared.camera, settings) {
            return skip(reason);
        }
        let n_per_sample = n_per_sample(settings);
        if is_exact(settings)
            && n_per_sample.saturating_mul(settings.samples_per_pixel) < LEAST_EMITTED
        {
            return skip("so few samples are not worth a look at them");
        }
        let max_specular = settings.max_depth.div_ceil(2);
        let plan = |emitter, first_radius, kept_per_path| Self {
            emitter,
            n_per_sample,
            first_radius,
            max_specular,
            kept_per_path,
        };
        let share = frame.path_share();
        let request = pilot_request(settings, frame.n_threads);
        // Where only caustics count.
        let caustic_request = PhotonRequest {
            max_depth: max_specular + 1,
            ..request
        };
        if let Some(radius) = settings.photons.radius {
            let n_emitted = n_per_sample.saturating_mul(settings.samples_per_pixel) / PILOT_SHARE;
            let request = PhotonRequest {
                n_emitted: n_emitted.min(N_PILOT),
                ..caustic_request
            };
            let traced = trace_photons_shared(prepared, &request, share)?;
            frame.lock_outcome().add_photons(&traced);
            // Nobody has told how many aimed paths leave photons.
            let emitter = emitter.aimed_by(&traced.useful_rays);
            return Ok(Ok(plan(emitter, radius, 1.0)));
        }

        // Where do photons have to go?
        let Pilot {
            importons,
            traced,
            n_blocks,
            mean_luminance,
            ..
        } = pilot(prepared, settings.resolution, &request, share)?;
        frame.lock_outcome().add_photons(&traced);
        if is_exact(settings) {
            let mut plan = plan(emitter.aimed_by(&traced.useful_rays), 0.0, 0.0);
            if traced.useful_rays.is_empty() {
                return skip("too few arrive where they are seen");
            }
            let gain = plan.aim_at_what_is_seen(frame, &emitter, request, mean_luminance)?;
            return if gain >= LEAST_GAIN {
                Ok(Ok(plan))
            } else {
                skip(&too_little(gain))
            };
        }
        let emitter = emitter.aimed_by(&traced.useful_rays);

        // How dense are they then?
        let request = PhotonRequest {
            seed: combine(settings.seed, AIMED_PILOT),
            ..caustic_request
        };
        let aimed = trace_caustic_photons(prepared, &emitter, &request, share)?;
        frame.lock_outcome().add_photons(&aimed);
        let photons = &aimed.photons;
        match first_radius(&importons, photons, N_PILOT, n_per_sample, IMPORTON_BLOCK) {
            Some(CausticLight { radius, variance }) => {
                let gain = variance / n_blocks / (mean_luminance * mean_luminance);
                if gain < LEAST_GAIN {
                    return skip(&too_little(gain));
                }
                let kept_per_path = photons.len() as f64 / f64::from(N_PILOT);
                Ok(Ok(plan(emitter, radius, kept_per_path)))
            }
            None => skip("too few arrive where they are seen"),
        }
    }

    /// Aims light from anywhere at what the camera is found to see of it, in three rounds. Returns what photons
    /// are worth, as [`Self::look`] has it.
    fn aim_at_what_is_seen(
        &mut self,
        frame: &Frame,
        anywhere: &Emitter<'a>,
        request: PhotonRequest,
        mean_luminance: f64,
    ) -> Result<f64, RenderError> {
        let mut rays = Vec::new();
        let mut gain = 0.0;
        for round in 0..3 {
            let request = PhotonRequest {
                seed: combine(frame.settings.seed, AIMED_PILOT - round),
                ..request
            };
            let seen = self.look(frame, &request, mean_luminance)?;
            gain = seen.gain;
            rays.extend(seen.rays);
            if rays.len() >= UsefulRay::MIN_TO_AIM {
                self.emitter = anywhere.aimed_by(&rays);
            }
        }
        Ok(gain)
    }

    /// Radius of the sample with that number, from zero.
    pub(super) fn radius(&self, sample_idx: u32) -> f32 {
        let mut radius = ProgressiveRadius::new(self.first_radius);
        for _ in 0..sample_idx {
            radius.advance();
        }
        radius.radius()
    }
}

fn too_little(gain: f64) -> String {
    format!("they take too little of the noise, {gain:.1e} of a sample's squared mean")
}

/// Why no photons are traced whatever they would bring, if that is so.
pub(super) fn why_no_photons(
    scene: &Scene,
    camera: &Camera,
    settings: &RenderSettings,
) -> Option<&'static str> {
    if settings.max_depth < 2 {
        return Some("paths are too short for caustics");
    }
    if scene.prototypes.iter().any(moves) {
        return Some("something moves while the shutter is open");
    }
    if is_exact(settings) && !camera.later_world_from_camera.is_empty() {
        return Some("the camera moves while the shutter is open");
    }
    None
}

/// Whether the camera is to see photons itself, as they may not be merged with.
fn is_exact(settings: &RenderSettings) -> bool {
    settings.gi == GlobalIllumination::Exact
}

/// Whether photons are not to be looked at, whatever they would bring.
pub(super) fn is_left_to_paths(settings: &RenderSettings) -> bool {
    is_exact(settings) && settings.photons.found_by == CausticStrategy::Paths
}

fn pilot_request(settings: &RenderSettings, n_threads: usize) -> PhotonRequest {
    PhotonRequest {
        n_emitted: N_PILOT,
        max_depth: settings.max_depth,
        seed: settings.seed,
        n_threads,
        shading: settings.shading,
    }
}

/// As many for each pixel, also for those that are not rendered, so that a part of a picture is as it
/// is in the whole.
pub(super) fn n_per_sample(settings: &RenderSettings) -> u32 {
    let [width, height] = settings.resolution;
    let asked = settings.photons.emitted_per_sample;
    asked.unwrap_or_else(|| width.saturating_mul(height).div_ceil(SAMPLES_PER_PATH))
}
