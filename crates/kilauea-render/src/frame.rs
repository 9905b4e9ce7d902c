//! A frame as engine threads see it: the program that they run, and where its results go.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use kilauea_film::{Film, Filter, PixelSample};
use kilauea_math::Vec2;
use kilauea_scene::{RenderSettings, Shading};
use kilauea_spot::{
    Bytes, Context, Engine, Job, Pool, Program, Queue, RunError, Runtime, Server, Stats,
};

use crate::RenderError;
use crate::camera::{CameraRay, RayGenerator};
use crate::integrator::{
    Air, Answer, Blame, Fault, Faults, FirstFault, Media, MediumStack, PathIntegrator, Question,
    RayCounts, RayTracer, SampleId, Step, Unwatched, media_around,
};
use crate::needs::SceneNeeds;
use crate::passes::{Passes, PixelRun, TILE_SIZE};
use crate::prepared::PreparedScene;
use crate::sampler::{Purpose, Sampler, SamplerTables};

/// What a run of SPOTs needs of a frame, and what it leaves there.
pub(crate) struct Frame {
    pub(crate) prepared: Arc<PreparedScene>,
    pub(crate) settings: RenderSettings,
    pub(crate) needs: SceneNeeds,
    pub(crate) film: Film,
    pub(crate) filter: Filter,
    pub(crate) camera: RayGenerator,
    pub(crate) sampler: SamplerTables,
    pub(crate) passes: Passes,
    pub(crate) n_threads: usize,
    pub(crate) n_pixels: u64,
    pub(crate) pixels_sampled: AtomicU64,
    pub(crate) is_cancelled: AtomicBool,
    pub(crate) start: Instant,
    pub(crate) deadline: Option<Instant>,
    pub(crate) blame: Blame,
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
    pub(crate) render_secs: f64,
    /// Highest in any run.
    pub(crate) shade_bytes_peak: usize,
}

/// The program: a SPOT takes the samples of some pixels, one after the other.
///
/// A path has one ray to follow and one light to look at, so its vertices need no SPOTs of their
/// own: they would only hand on its throughput.
struct PixelProgram<'f, const CUTOUTS: bool, M> {
    frame: &'f Frame,
    integrator: PathIntegrator<'f, CUTOUTS, M>,
}

/// What a SPOT did.
pub(crate) struct Sampled {
    n_pixels: u32,
    counts: RayCounts,
}

/// Some passes, cut into roots of so many pixels.
struct PassesJob<'f> {
    frame: &'f Frame,
    passes: Range<u32>,
    n_pixels: u32,
}

impl Frame {
    pub(crate) fn lock_outcome(&self) -> MutexGuard<'_, Outcome> {
        self.outcome.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Renders until all samples are taken, the time is up or something fails.
    pub(crate) fn render(&self) {
        let has_cutouts = self.needs.cutouts || self.needs.nested_media;
        let result = match (self.needs.media, has_cutouts) {
            (false, false) => self.run_passes::<false, _>(Air),
            (false, true) => self.run_passes::<true, _>(Air),
            (true, false) => self.run_passes::<false, _>(self.camera_media()),
            (true, true) => self.run_passes::<true, _>(self.camera_media()),
        };
        let mut outcome = self.lock_outcome();
        if let Err(error) = result {
            outcome.error = self.render_error(error);
        }
        outcome.render_secs = self.start.elapsed().as_secs_f64();
        outcome.has_ended = true;
        drop(outcome);
        self.ended.notify_all();
    }

    /// The media where the ray through the centre of the picture starts, as the shutter opens.
    fn camera_media(&self) -> MediumStack {
        let [width, height] = self.settings.resolution.map(|n| n as f32);
        let center = Vec2::new(width, height) / 2.0;
        let ray = self.camera.ray(center, Vec2::splat(0.5), 0.0).ray;
        let prepared = &*self.prepared;
        media_around(ray.at(ray.t_min), &prepared.geometry, &prepared.textures)
    }

    fn run_passes<const CUTOUTS: bool, M: Media>(&self, camera_media: M) -> Result<(), RunError> {
        let prepared = &*self.prepared;
        let program = PixelProgram {
            frame: self,
            integrator: PathIntegrator::<CUTOUTS, M> {
                geometry: &prepared.geometry,
                lights: &prepared.lights,
                textures: &prepared.textures,
                max_depth: self.settings.max_depth,
                samples_per_pixel: self.settings.samples_per_pixel,
                needs: self.needs,
                camera_media,
                blame: &self.blame,
                watch: Unwatched,
            },
        };
        let tracer = RayTracer::<CUTOUTS> {
            geometry: &prepared.geometry,
            textures: &prepared.textures,
            blame: &self.blame,
        };
        let engine = Engine::new(self.n_threads)
            .budget_bytes(usize::try_from(self.settings.shade_memory_bytes).unwrap_or(usize::MAX));
        match self.settings.shading {
            Shading::Inline => {
                let job = PassesJob {
                    frame: self,
                    passes: 0..self.passes.n_passes(),
                    n_pixels: TILE_SIZE * TILE_SIZE,
                };
                engine.run_inline(&program, &tracer, &job).map(drop)
            }
            Shading::Queued => self.run_queued(&engine, &program, &Queue::new(&tracer)),
            Shading::Bytes => self.run_queued(&engine, &program, &Bytes::new(&tracer)),
        }
    }

    /// Each pass is a run of its own, as a pixel's passes must be summed in order. Each pixel is a
    /// root, so that many are under way.
    fn run_queued<P: Program<Output = Sampled, Work = PixelRun>>(
        &self,
        engine: &Engine,
        program: &P,
        server: &impl Server<P>,
    ) -> Result<(), RunError> {
        for pass in 0..self.passes.n_passes() {
            let job = PassesJob {
                frame: self,
                passes: pass..pass + 1,
                n_pixels: 1,
            };
            let stats = engine.run_queued(program, server, self.n_threads, &job)?;
            self.note_memory(&stats);
        }
        Ok(())
    }

    fn note_memory(&self, stats: &Stats) {
        let peak = &mut self.lock_outcome().shade_bytes_peak;
        *peak = stats.peak_bytes().max(*peak);
    }

    /// What a failed run means for the frame; nothing if it was told to stop.
    fn render_error(&self, error: RunError) -> Option<RenderError> {
        let material = self.blame.material().map(str::to_owned);
        match (error, material) {
            (RunError::Cancelled, _) => None,
            (
                RunError::Panicked { message, .. } | RunError::ThreadPanicked { message, .. },
                Some(material),
            ) => Some(RenderError::ShaderPanicked { material, message }),
            (error, _) => Some(RenderError::Panic(error.to_string())),
        }
    }

    fn is_cancelled(&self) -> bool {
        self.is_cancelled.load(Ordering::Relaxed)
    }

    fn is_late(&self) -> bool {
        self.deadline.is_some_and(|d| Instant::now() >= d)
    }
}

impl<const CUTOUTS: bool, M: Media> Program for PixelProgram<'_, CUTOUTS, M> {
    type Work = PixelRun;
    type Output = Sampled;
    type Question = Question;
    type Answer = Answer;

    fn starter<'a, R: Runtime<'a, Self>>(
        &'a self,
        runtime: &R,
    ) -> impl Fn(PixelRun, R::Context) -> R::Started {
        let pixels = runtime.pool();
        move |run, cx| pixels.start("a pixel's samples", self.sample_pixels(run, cx))
    }
}

impl<const CUTOUTS: bool, M: Media> PixelProgram<'_, CUTOUTS, M> {
    /// Takes the samples that some pixels get in a pass, and adds them to the film.
    async fn sample_pixels<C: Context<Self>>(&self, run: PixelRun, cx: C) -> Sampled {
        let frame = self.frame;
        // Others may wait for these pixels.
        let _stop = StopOnPanic(frame);
        let mut sampled = Sampled {
            n_pixels: 0,
            counts: RayCounts::default(),
        };
        for pixel_idx in run.pixels {
            if frame.is_cancelled() {
                break;
            }
            let pixel = frame.passes.pixel(run.tile, pixel_idx);
            let sequence = frame.sampler.pixel(pixel);
            let center = Vec2::new(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5);
            for sample_idx in frame.passes.samples(run.pass) {
                let sampler = sequence.sampler(sample_idx);
                let offset = frame.filter.sample(sampler.pair(Purpose::Filter));
                let lens = if frame.needs.lens {
                    sampler.pair(Purpose::Lens)
                } else {
                    Vec2::splat(0.5)
                };
                let time = if frame.needs.motion {
                    sampler.pair(Purpose::Time).x
                } else {
                    0.0
                };
                let ray = frame.camera.ray(center + offset, lens, time);
                let counts = &mut sampled.counts;
                let mut sample = self
                    .integrator
                    .trace(&ray, &frame.camera, &sampler, counts, &cx)
                    .await;
                sample.offset_sq = offset.length_squared();
                let exposure = frame.prepared.scene.camera.exposure_scale;
                if exposure != 1.0 {
                    expose(&mut sample, exposure);
                }
                let is_finite = frame
                    .film
                    .tile(run.tile as usize)
                    .add(pixel_idx as usize, &sample);
                if !is_finite {
                    // In a box, as room for it would be in the state of every path.
                    let fault = Box::pin(self.find_fault(&ray, &sampler, &cx)).await;
                    let id = SampleId {
                        row: pixel[1],
                        column: pixel[0],
                        sample: sample_idx,
                    };
                    frame.lock_outcome().faults.add(id, fault);
                }
            }
            sampled.n_pixels += 1;
        }
        sampled
    }

    /// Traces a path again to see where it stopped being finite. Its rays are not counted.
    #[cold]
    async fn find_fault<C: Context<Self>>(
        &self,
        ray: &CameraRay,
        sampler: &Sampler<'_>,
        cx: &C,
    ) -> Fault {
        let first = FirstFault::default();
        let mut counts = RayCounts::default();
        self.integrator
            .watched_by(&first)
            .trace(ray, &self.frame.camera, sampler, &mut counts, cx)
            .await;
        first.get().unwrap_or(Fault {
            step: Step::Exposure,
            depth: 0,
            at: None,
        })
    }
}

/// Stops a frame whose code panicked.
struct StopOnPanic<'f>(&'f Frame);

impl Drop for StopOnPanic<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.is_cancelled.store(true, Ordering::Relaxed);
        }
    }
}

impl PassesJob<'_> {
    fn run(&self, number: u64) -> Option<PixelRun> {
        self.frame.passes.run(&self.passes, self.n_pixels, number)
    }
}

impl<P: Program<Work = PixelRun, Output = Sampled>> Job<P> for PassesJob<'_> {
    fn root(&self, number: u64) -> Option<PixelRun> {
        if self.frame.is_late() {
            return None;
        }
        let run = self.run(number)?;
        // With fewer tiles than threads the previous pass may still be under way: sums must be
        // made in order. Its thread never waits for this one.
        while !self.frame.passes.is_turn_of(run.pass, run.tile) {
            if self.frame.is_cancelled() || self.frame.is_late() {
                return None;
            }
            std::thread::yield_now();
        }
        Some(run)
    }

    fn done(&self, number: u64, sampled: Sampled) {
        let Some(run) = self.run(number) else { return };
        let frame = self.frame;
        frame.lock_outcome().counts.add(sampled.counts);
        let n_samples = u64::from(sampled.n_pixels) * frame.passes.samples(run.pass).len() as u64;
        frame.pixels_sampled.fetch_add(n_samples, Ordering::Relaxed);
        frame.passes.note_done(run.tile, sampled.n_pixels);
    }

    fn is_cancelled(&self) -> bool {
        self.frame.is_cancelled()
    }
}

/// Scales all light of a sample.
fn expose(sample: &mut PixelSample, exposure: f32) {
    for light in [
        &mut sample.beauty,
        &mut sample.emission,
        &mut sample.direct_diffuse,
        &mut sample.direct_specular,
        &mut sample.indirect_diffuse,
        &mut sample.indirect_specular,
    ] {
        *light *= exposure;
    }
}
