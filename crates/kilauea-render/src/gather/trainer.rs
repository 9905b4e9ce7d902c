use kilauea_gather::{ChoiceRecords, GatherField, GatherRecord, PictureSample};
use kilauea_spot::RunError;

use super::training_pass::{TrainingGrid, TrainingPaths};
use crate::follow::{Workforce, follow_all};
use crate::frame::Frame;
use crate::integrator::{Guided, Media, PathIntegrator, RayTracer, Training};
use crate::samples::PixelSampler;

/// Runs training passes, and keeps what they find.
pub(super) struct Trainer<'f, 'a, const CUTOUTS: bool, M> {
    frame: &'f Frame,
    integrator: PathIntegrator<'a, CUTOUTS, M>,
    tracer: &'f RayTracer<'a, CUTOUTS>,
    pub(super) records: Vec<GatherRecord>,
    pub(super) choices: ChoiceRecords,
    /// Of the shortest pass.
    pass_paths: f64,
    n_passes: u32,
    pub(super) n_paths: u64,
}

/// Share of a frame's paths in the shortest pass.
const PASS_SHARE: f64 = 1.0 / 128.0;
/// Fewer tell nothing.
const LEAST_PATHS: f64 = 512.0;
/// More train no further: records take memory.
const MOST_PATHS: f64 = (1 << 15) as f64;

impl<'f, 'a, const CUTOUTS: bool, M: Media> Trainer<'f, 'a, CUTOUTS, M> {
    /// None for a frame of so few paths that too few of them would train.
    pub(super) fn new(
        frame: &'f Frame,
        integrator: PathIntegrator<'a, CUTOUTS, M>,
        tracer: &'f RayTracer<'a, CUTOUTS>,
    ) -> Option<Self> {
        let n_paths = frame.n_pixels as f64 * f64::from(frame.settings.samples_per_pixel);
        let pass_paths = PASS_SHARE * n_paths;
        let is_enough = pass_paths >= LEAST_PATHS || frame.needs.learns();
        is_enough.then(|| Self {
            frame,
            integrator,
            tracer,
            records: Vec::new(),
            choices: ChoiceRecords::default(),
            pass_paths: pass_paths.clamp(LEAST_PATHS, MOST_PATHS),
            n_passes: 0,
            n_paths: 0,
        })
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
        let paths = TrainingPaths {
            sampler: PixelSampler {
                frame: self.frame,
                integrator: self.integrator.guided_by(Training { guide }),
            },
            grid: &grid,
        };
        let workforce = Workforce::inline(self.frame.n_threads);
        let mut samples = Vec::new();
        for trained in follow_all(&paths, grid.n_blocks, self.tracer, workforce)? {
            self.frame.lock_outcome().counts.add(trained.counts);
            self.records.extend(trained.records);
            self.choices.append(&trained.choices);
            samples.extend(trained.samples);
        }
        self.n_passes += 1;
        self.n_paths += samples.len() as u64;
        Ok(samples)
    }

    /// A field of all records.
    pub(super) fn fit(&self) -> Option<GatherField> {
        GatherField::fit(&self.records)
    }
}
