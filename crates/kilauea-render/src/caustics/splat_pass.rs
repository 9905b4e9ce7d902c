//! What the camera sees of the photons of a pass of samples.

use std::time::Instant;

use kilauea_scene::DataWindow;

use super::plan::CausticPlan;
use super::splats::{PassPaths, Splat, Splats};
use crate::RenderError;
use crate::frame::Frame;
use crate::integrator::{LightTracing, RayCone, SplatShares};
use crate::light::UsefulRay;
use crate::photon::{PhotonRequest, SplatView, trace_splats};

/// What the samples of a pass get of photons that the camera sees.
pub(crate) struct SplatPass<'a> {
    plan: &'a CausticPlan<'a>,
    frame: &'a Frame,
    shares: SplatShares<'a>,
    splats: Splats,
}

/// What a few photons tell of all.
pub(super) struct Look {
    /// Variance of a sample that photons take off paths where the camera sees them, relative to the square
    /// of the mean luminance of pixels.
    pub(super) gain: f64,
    /// How the light left of those that are seen.
    pub(super) rays: Vec<UsefulRay>,
}

/// Where less is left, paths do not find the light at all.
const LEAST_LEFT: f32 = 1e-6;

impl CausticPlan<'_> {
    /// Looks at the photons of `request`.
    ///
    /// Of light f that a photon brings with the density M p, of M for each sample, and a path with q, the second
    /// moment is f²/q by paths alone and f²/(M p + q) by both with weights of the balance heuristic: less by
    /// (w f / M p)² / (1 - w) for a photon of the weight w.
    pub(super) fn look(
        &self,
        frame: &Frame,
        request: &PhotonRequest,
        mean_luminance: f64,
    ) -> Result<Look, RenderError> {
        let start = Instant::now();
        let shares = splat_shares(frame, self.n_per_sample as f32);
        let splat_view = SplatView {
            // As many for each pixel, also where only some are rendered.
            window: whole(frame),
            scouts: true,
            ..splat_view(frame, shares)
        };
        let share = frame.path_share();
        let traced = trace_splats(&frame.prepared, &self.emitter, &splat_view, request, share)?;
        let seconds = start.elapsed().as_secs_f64();
        (frame.lock_outcome()).add_photon_counts(&traced.counts, seconds);
        let per_sample = f64::from(request.n_emitted) / f64::from(self.n_per_sample.max(1));
        let taken = |splat: &Splat| {
            let luminance = f64::from((splat.diffuse + splat.specular).luminance()) * per_sample;
            luminance * luminance / f64::from(splat.left.max(LEAST_LEFT))
        };
        let sum = traced.splats.iter().map(taken).sum::<f64>() / per_sample;
        let n_pixels = frame
            .settings
            .resolution
            .map(f64::from)
            .iter()
            .product::<f64>();
        let gain = sum / n_pixels / (mean_luminance * mean_luminance);
        Ok(Look {
            gain: if gain.is_finite() { gain } else { 0.0 },
            rays: traced.rays,
        })
    }

    /// Traces what the camera sees of the photons of a pass.
    pub(crate) fn trace_splats<'s>(
        &'s self,
        frame: &'s Frame,
        pass: u32,
    ) -> Result<SplatPass<'s>, RenderError> {
        let start = Instant::now();
        let samples = frame.passes.samples(&(pass..pass + 1));
        let n_samples = samples.len() as u32;
        let request = self.pass_request(frame, pass, frame.settings.max_depth);
        let n_emitted = request.n_emitted;
        let shares = splat_shares(frame, n_emitted as f32 / n_samples as f32);
        let splat_view = splat_view(frame, shares);
        let share = frame.path_share();
        let traced = trace_splats(&frame.prepared, &self.emitter, &splat_view, &request, share)?;
        let paths = PassPaths {
            first_sample: samples.start,
            n_samples,
            n_paths: n_emitted,
        };
        let splats = Splats::sorted(&traced.splats, splat_view.window, paths);
        let mut outcome = frame.lock_outcome();
        outcome.add_photon_counts(&traced.counts, start.elapsed().as_secs_f64());
        let caustics = &mut outcome.caustics;
        caustics.emitted += traced.counts.emitted;
        caustics.stored += splats.len() as u64;
        caustics.bytes_peak = caustics.bytes_peak.max(splats.bytes() as u64);
        drop(outcome);
        Ok(SplatPass {
            plan: self,
            frame,
            shares,
            splats,
        })
    }
}

/// How photons and paths share light in a frame.
fn splat_shares(frame: &Frame, paths_per_sample: f32) -> SplatShares<'_> {
    SplatShares {
        camera: &frame.camera,
        paths_per_sample,
        found_by: frame.settings.photons.found_by,
    }
}

/// How the camera looks at photons for the pixels of a frame.
fn splat_view<'a>(frame: &'a Frame, shares: SplatShares<'a>) -> SplatView<'a> {
    SplatView {
        shares,
        filter: &frame.filter,
        window: frame.film.data_window(),
        cone: RayCone::of_camera_ray(&frame.camera, frame.settings.samples_per_pixel),
        scouts: false,
    }
}

/// All pixels of a picture.
fn whole(frame: &Frame) -> DataWindow {
    DataWindow {
        min: [0; 2],
        max: frame.settings.resolution.map(|n| n as i32),
    }
}

impl SplatPass<'_> {
    /// What paths need of it.
    pub(crate) fn merge(&self) -> LightTracing<'_> {
        let prepared = &self.frame.prepared;
        LightTracing {
            splats: &self.splats,
            emitter: &self.plan.emitter,
            geometry: &prepared.geometry,
            shares: self.shares,
            has_masks: prepared.needs.masks,
        }
    }
}
