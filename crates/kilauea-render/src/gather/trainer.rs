use kilauea_gather::{GatherField, GatherRecord, PathError, PictureSample};
use kilauea_spot::{Engine, RunError};

use super::GatherEstimate;
use super::training_pass::{TrainingGrid, TrainingJob, TrainingProgram};
use crate::frame::Frame;
use crate::integrator::{Guided, Means, Media, PathIntegrator, RayTracer, Training};
use crate::samples::PixelSampler;

/// Runs training passes, and keeps what they find.
pub(super) struct Trainer<'f, 'a, const CUTOUTS: bool, M> {
    frame: &'f Frame,
    integrator: PathIntegrator<'a, CUTOUTS, M>,
    tracer: &'f RayTracer<'a, CUTOUTS>,
    pub(super) records: Vec<GatherRecord>,
    /// Of the shortest pass.
    pass_paths: f64,
    n_passes: u32,
    pub(super) n_paths: u64,
}

/// Share of a frame's paths in the shortest pass.
const PASS_SHARE: f64 = 1.0 / 96.0;
/// Of small frames, a pass is longer, so that it tells anything.
const LARGEST_PASS_SHARE: f64 = 1.0 / 32.0;
const FEW_PATHS: f64 = 2048.0;
/// More train no further: records take memory.
const MOST_PATHS: f64 = (1 << 15) as f64;

impl<'f, 'a, const CUTOUTS: bool, M: Media> Trainer<'f, 'a, CUTOUTS, M> {
    pub(super) fn new(
        frame: &'f Frame,
        integrator: PathIntegrator<'a, CUTOUTS, M>,
        tracer: &'f RayTracer<'a, CUTOUTS>,
    ) -> Self {
        let n_paths = frame.n_pixels as f64 * f64::from(frame.settings.samples_per_pixel);
        let least = FEW_PATHS.min(LARGEST_PASS_SHARE * n_paths);
        Self {
            frame,
            integrator,
            tracer,
            records: Vec::new(),
            pass_paths: (PASS_SHARE * n_paths).clamp(least, MOST_PATHS),
            n_passes: 0,
            n_paths: 0,
        }
    }

    /// Traces a pass so many times the shortest. Returns two samples of each pixel that it looked
    /// at, or a multiple of two.
    pub(super) fn run(
        &mut self,
        length: u32,
        guide: Option<Guided<'_>>,
    ) -> Result<Vec<PictureSample>, RunError> {
        let n_paths = f64::from(length) * self.pass_paths;
        let grid = TrainingGrid::new(self.frame, self.n_passes, n_paths);
        let program = TrainingProgram {
            sampler: PixelSampler {
                frame: self.frame,
                integrator: self.integrator.guided_by(Training { guide }),
            },
            grid: &grid,
        };
        let job = TrainingJob::new(self.frame, &grid);
        Engine::new(self.frame.n_threads).run_inline(&program, self.tracer, &job)?;
        let (records, samples) = job.into_found();
        self.n_passes += 1;
        self.n_paths += samples.len() as u64;
        // What paths that end early find comes in few, large pieces.
        if guide.is_none_or(|guide| !guide.means.roulette) {
            self.records.extend(records);
        }
        Ok(samples)
    }

    /// The error of paths that use `means`; `otherwise` where none were traced in time.
    pub(super) fn error(
        &mut self,
        length: u32,
        estimate: &GatherEstimate,
        means: Means,
        otherwise: PathError,
    ) -> Result<PathError, RunError> {
        let guide = estimate.guide_by(means, otherwise);
        let samples = self.run(length, Some(guide))?;
        Ok(estimate.picture.error_of(&samples).unwrap_or(otherwise))
    }

    /// A field of all records.
    pub(super) fn fit(&self) -> Option<GatherField> {
        GatherField::fit(&self.records)
    }
}
