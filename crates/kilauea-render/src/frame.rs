//! A frame as engine threads see it: how it is run, and where its results go.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use kilauea_film::{Film, Filter};
use kilauea_math::Vec2;
use kilauea_scene::{RenderSettings, Shading};
use kilauea_spot::{Bytes, Delayed, Engine, Order, Program, Queue, RunError, Server, Split};

use crate::RenderError;
use crate::camera::RayGenerator;
use crate::conditions::Conditions;
use crate::gather::GatherEstimate;
use crate::integrator::{
    Blame, Faults, Guide, Media, MediumStack, Merge, PathIntegrator, RayCone, RayCounts, RayTracer,
    Unguided, Unmerged, Unwatched, media_around,
};
use crate::needs::SceneNeeds;
use crate::noise::{NoiseGate, n_pixels_below};
use crate::passes::{Passes, PixelRun, TILE_SIZE};
use crate::photon::{PhotonCounts, TracedPhotons};
use crate::plain::run_plain;
use crate::prepared::PreparedScene;
use crate::program::{PassesJob, PixelProgram, PixelRoots, Sampled};
use crate::sampler::SamplerTables;
use crate::samples::PixelSampler;
use crate::set::{PhotonParts, SetParts, Traffic};
use crate::shades::Shades;
use crate::share::PathShare;
use crate::stats::{AimStats, CausticStats, FinalGatherStats};
use crate::unit_pixels::UnitPixels;
use crate::units::UnitSource;

/// What a run of SPOTs needs of a frame, and what it leaves there.
pub(crate) struct Frame {
    pub(crate) prepared: Arc<PreparedScene>,
    pub(crate) settings: RenderSettings,
    pub(crate) conditions: Conditions,
    pub(crate) needs: SceneNeeds,
    pub(crate) film: Film,
    pub(crate) filter: Filter,
    pub(crate) camera: RayGenerator,
    pub(crate) sampler: SamplerTables,
    pub(crate) passes: Passes,
    /// Where work comes from that others hand out; none where all of the frame is done here.
    pub(crate) units: Option<Arc<dyn UnitSource>>,
    /// What the pilot of the same frame told before; none where this one has its own.
    pub(crate) told: Option<Arc<GatherEstimate>>,
    /// Where sampling stops early; none where all pixels get all samples.
    pub(crate) noise: Option<NoiseGate>,
    pub(crate) n_threads: usize,
    pub(crate) n_pixels: u64,
    pub(crate) pixels_sampled: AtomicU64,
    pub(crate) is_cancelled: AtomicBool,
    /// Code of a sample did. Apart from the above, which is no error to those who ask.
    pub(crate) has_panicked: AtomicBool,
    pub(crate) start: Instant,
    pub(crate) deadline: Option<Instant>,
    pub(crate) blame: Blame,
    /// With the members of a set.
    pub(crate) traffic: Traffic,
    /// Photons that are divided among the members of a set.
    pub(crate) photons: Arc<PhotonParts>,
    /// The number after that of the last pass for which somebody had them no more.
    pub(crate) lost_photons: AtomicU32,
    pub(crate) outcome: Mutex<Outcome>,
    pub(crate) ended: Condvar,
}

/// What is known once rendering has stopped, and counters until then.
#[derive(Default)]
pub(crate) struct Outcome {
    pub(crate) has_ended: bool,
    pub(crate) counts: RayCounts,
    /// Of samples that were not finite.
    pub(crate) faults: Faults,
    pub(crate) error: Option<RenderError>,
    /// For training paths, and for what they told.
    pub(crate) gather_secs: f64,
    pub(crate) render_secs: f64,
    pub(crate) shades: Shades,
    /// What final paths were told.
    pub(crate) learnt: Arc<GatherEstimate>,
    pub(crate) caustics: CausticStats,
    pub(crate) aim: AimStats,
    pub(crate) final_gather: FinalGatherStats,
}

impl Outcome {
    /// Notes that photons were traced.
    pub(crate) fn add_photons(&mut self, traced: &TracedPhotons) {
        self.add_photon_counts(&traced.counts, traced.seconds);
    }

    /// The same, by what was counted meanwhile.
    pub(crate) fn add_photon_counts(&mut self, counts: &PhotonCounts, seconds: f64) {
        self.caustics.rays += counts.rays;
        self.caustics.seconds += seconds;
        self.counts.invalid += counts.invalid_rays;
        self.counts.in_too_many_media += counts.in_too_many_media;
    }
}

impl Frame {
    pub(crate) fn lock_outcome(&self) -> MutexGuard<'_, Outcome> {
        self.outcome.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Renders until all samples are taken, the time is up or something fails.
    pub(crate) fn render(&self) {
        let result = self.take_samples();
        self.photons.close();
        let mut outcome = self.lock_outcome();
        outcome.error = result.err();
        let before_paths = outcome.gather_secs + outcome.caustics.seconds;
        outcome.render_secs = self.start.elapsed().as_secs_f64() - before_paths;
        outcome.has_ended = true;
        drop(outcome);
        self.ended.notify_all();
    }

    /// The media where the ray through the centre of the picture starts, as the shutter opens.
    pub(crate) fn camera_media(&self) -> MediumStack {
        let [width, height] = self.settings.resolution.map(|n| n as f32);
        let center = Vec2::new(width, height) / 2.0;
        let ray = self.camera.ray(center, Vec2::splat(0.5), 0.0).ray;
        media_around(ray.at(ray.t_min), &self.tracer())
    }

    pub(crate) fn tracer<const CUTOUTS: bool>(&self) -> RayTracer<'_, CUTOUTS> {
        RayTracer {
            sends_texels: self.settings.shading == Shading::Bytes,
            ..RayTracer::of(&self.prepared, &self.blame)
                .asking(self.conditions.broadcast, &self.photons)
        }
    }

    /// The integrator of paths that know nothing beforehand.
    pub(crate) fn integrator<const CUTOUTS: bool, M: Media>(
        &self,
        camera_media: M,
    ) -> PathIntegrator<'_, CUTOUTS, M> {
        let prepared = &*self.prepared;
        PathIntegrator {
            geometry: &prepared.geometry,
            lights: &prepared.lights,
            textures: &prepared.textures,
            max_depth: self.settings.max_depth,
            camera_cone: RayCone::of_camera_ray(&self.camera, self.settings.samples_per_pixel),
            needs: self.needs,
            // Members of a set have the files, each for itself.
            asks_for_tiles: self.needs.textures && prepared.set.is_none(),
            camera_media,
            guide: Unguided,
            merge: Unmerged,
            blame: &self.blame,
            watch: Unwatched,
        }
    }

    /// Takes the samples of some passes.
    pub(crate) fn run_some<const CUTOUTS: bool, M: Media, G: Guide, X: Merge>(
        &self,
        integrator: PathIntegrator<'_, CUTOUTS, M, G, X>,
        passes: Range<u32>,
    ) -> Result<(), RenderError> {
        let sampler = PixelSampler {
            frame: self,
            integrator,
        };
        self.run_samples(sampler, &self.tracer(), passes)
            .or_else(|error| self.stopped_by(error))
    }

    /// A frame that was told to stop has not failed.
    pub(crate) fn stopped_by(&self, error: RunError) -> Result<(), RenderError> {
        if error == RunError::Cancelled {
            return Ok(());
        }
        let geometry = &self.prepared.geometry;
        Err(RenderError::of_run(error, &self.blame, geometry))
    }

    fn run_samples<const CUTOUTS: bool, M: Media, G: Guide, X: Merge>(
        &self,
        sampler: PixelSampler<'_, CUTOUTS, M, G, X>,
        tracer: &RayTracer<'_, CUTOUTS>,
        passes: Range<u32>,
    ) -> Result<(), RunError> {
        let job = PassesJob {
            frame: self,
            passes: passes.clone(),
            n_pixels: TILE_SIZE * TILE_SIZE,
        };
        if self.conditions.plain_loop {
            return run_plain(&sampler, tracer, &job, self.n_threads);
        }
        let program = PixelProgram { sampler };
        let delay_secs = self.conditions.answer_delay_ms / 1e3;
        let max_delay = Duration::try_from_secs_f64(delay_secs).unwrap_or_default();
        if let Some(asker) = tracer.set
            && self.settings.shading != Shading::Inline
        {
            let parts = SetParts::<CUTOUTS> {
                as_bytes: (self.settings.shading == Shading::Bytes)
                    .then_some(self.conditions.packing),
                ..SetParts::by_values(asker, &self.blame, &self.traffic)
            };
            return self.run_queued((&program, &Split::new(&parts), 1), passes);
        }
        match self.settings.shading {
            Shading::Inline => Engine::new(self.n_threads)
                .run_inline(&program, tracer, &job)
                .map(drop),
            Shading::Queued if !max_delay.is_zero() => {
                let server = Delayed::new(tracer, max_delay);
                self.run_queued((&program, &server, self.n_threads), passes)
            }
            Shading::Queued => {
                self.run_queued((&program, &Queue::new(tracer), self.n_threads), passes)
            }
            Shading::Bytes => {
                self.run_queued((&program, &Bytes::new(tracer), self.n_threads), passes)
            }
        }
    }

    /// Each pass is a run of its own, as a pixel's passes must be summed in order; of a unit, a pixel
    /// takes one after the other. Each pixel is a root, so that many are under way.
    fn run_queued<P: Program<Output = Sampled, Work = PixelRun>>(
        &self,
        (program, server, n_servers): (&P, &dyn Server<P>, usize),
        passes: Range<u32>,
    ) -> Result<(), RunError> {
        let memory = usize::try_from(self.settings.shade_memory_bytes).unwrap_or(usize::MAX);
        let engine = Engine::new(self.n_threads);
        let engine = if self.conditions.first_come {
            // A pixel leads to no SPOTs but its own, so it is the budget that holds back pixels.
            engine.order(Order::FirstCome).budget_bytes(usize::MAX)
        } else {
            engine.budget_bytes(memory)
        };
        let run = |roots: PixelRoots<'_>| {
            let stats = engine.run_queued(program, server, n_servers, &roots)?;
            self.lock_outcome().shades.add(&stats);
            Ok(())
        };
        if let Some(source) = &self.units {
            return run(PixelRoots::OfUnits(UnitPixels::new(
                self, &**source, passes,
            )));
        }
        for pass in passes {
            if self.is_late() {
                break;
            }
            run(PixelRoots::OfPass(PassesJob {
                frame: self,
                passes: pass..pass + 1,
                n_pixels: 1,
            }))?;
        }
        Ok(())
    }

    /// Whether a pixel, by number within its tile, is clean enough.
    #[inline]
    pub(crate) fn is_settled(&self, tile: u32, pixel: u32) -> bool {
        let is_settled =
            |noise: &NoiseGate| noise.is_settled(tile, pixel, self.passes.tile_width(tile));
        self.noise.as_ref().is_some_and(is_settled)
    }

    /// Whether all pixels are clean enough.
    pub(crate) fn is_clean(&self) -> bool {
        self.noise.as_ref().is_some_and(NoiseGate::is_all_settled)
    }

    /// Notes that some pixels are through a pass, and looks at their tile if they are its last.
    pub(crate) fn note_done(&self, run: &PixelRun, n_pixels: u32) {
        self.passes.note_done(run.tile, n_pixels, || {
            if let Some(noise) = &self.noise {
                let tile = self.film.tile(run.tile as usize);
                noise.look(run.tile, &tile, self.passes.samples(&run.passes).end);
            }
        });
    }

    /// Pixels that were clean enough before they had all samples.
    pub(crate) fn n_pixels_stopped(&self) -> u64 {
        let n_done = self.passes.n_done();
        if self.noise.is_none() || n_done == 0 {
            return 0;
        }
        n_pixels_below(&self.film, self.passes.samples(&(0..n_done)).end)
    }

    pub(crate) fn is_cancelled(&self) -> bool {
        self.is_cancelled.load(Ordering::Relaxed)
    }

    /// Who shares out paths that all who render the frame need; none where each follows its own.
    pub(crate) fn path_share(&self) -> Option<&dyn PathShare> {
        self.units.as_ref()?.path_share()
    }

    /// Whether samples of a pass lack photons that somebody had no more: its time is up, or all samples
    /// of the pass are there.
    pub(crate) fn has_lost_photons(&self, passes: &Range<u32>) -> bool {
        let lost = self.lost_photons.load(Ordering::Acquire);
        lost > 0 && passes.contains(&(lost - 1))
    }

    /// Whether nobody waits for more samples.
    pub(crate) fn is_over(&self) -> bool {
        self.is_cancelled() || self.has_panicked.load(Ordering::Relaxed)
    }

    pub(crate) fn is_late(&self) -> bool {
        self.deadline.is_some_and(|d| Instant::now() >= d)
    }
}
