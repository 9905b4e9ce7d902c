use kilauea_gather::{ChoiceField, ChoiceRecords, GatherField, GatherRecord, PictureSample};
use kilauea_spot::RunError;

use super::training_pass::{TrainingGrid, TrainingPaths};
use super::trial::{TrialGrid, TrialPaths, Tried};
use crate::frame::Frame;
use crate::integrator::{Guided, Media, Notes, PathIntegrator, RayTracer, Training, Unmerged};
use crate::samples::PixelSampler;
use crate::share::PathKind;

/// Runs training passes, and keeps what they find.
pub(super) struct Trainer<'f, 'a, const CUTOUTS: bool, M> {
    frame: &'f Frame,
    integrator: PathIntegrator<'a, CUTOUTS, M>,
    tracer: &'f RayTracer<'a, CUTOUTS>,
    pub(super) records: Vec<GatherRecord>,
    pub(super) choices: ChoiceRecords,
    /// Of the whole pilot.
    pub(super) pilot_paths: f64,
    n_passes: u32,
    pub(super) n_paths: u64,
}

/// Share of a frame's paths in the pilot.
const PILOT_SHARE: f64 = 1.0 / 128.0;
/// Share of the pilot that is looked at first, and ends it where there is nothing to hope for.
const FIRST_LOOK: f64 = 1.0 / 4.0;
/// Numbers the trial of lights.
const LIGHTS_TRIED: u32 = 0;
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
        let pilot_paths = PILOT_SHARE * n_paths;
        let is_enough = pilot_paths >= LEAST_PATHS || frame.needs.learns();
        is_enough.then(|| Self {
            frame,
            integrator,
            tracer,
            records: Vec::new(),
            choices: ChoiceRecords::default(),
            pilot_paths: pilot_paths.clamp(LEAST_PATHS, MOST_PATHS),
            n_passes: 0,
            n_paths: 0,
        })
    }

    /// How many paths the parts of the pilot have, one after the other.
    pub(super) fn looks(&self) -> impl Iterator<Item = f64> + use<CUTOUTS, M> {
        let first = (FIRST_LOOK * self.pilot_paths).max(LEAST_PATHS);
        let others = self.pilot_paths - first;
        std::iter::once(first).chain((others > 0.0).then_some(others))
    }

    /// Traces a pass of about so many paths. Returns two samples of each pixel that it looked at, or
    /// a multiple of two.
    pub(super) fn run(
        &mut self,
        n_paths: f64,
        guide: Option<Guided<'_>>,
        notes: Notes,
    ) -> Result<Vec<PictureSample>, RunError> {
        let grid = TrainingGrid::new(self.frame, self.n_passes, n_paths);
        let paths = TrainingPaths {
            sampler: self.sampler(Training { guide, notes }),
            grid: &grid,
        };
        let mut samples = Vec::new();
        let followed = grid
            .pixels
            .follow(&paths, PathKind::Training, self.frame, self.tracer)?;
        for trained in followed {
            self.frame.lock_outcome().counts.add(trained.counts);
            self.records.extend(trained.records);
            self.choices.append(&trained.choices);
            samples.extend(trained.samples);
        }
        self.n_passes += 1;
        self.n_paths += samples.len() as u64;
        Ok(samples)
    }

    /// Tries what lights bring by `field`, in some pixels.
    pub(super) fn try_lights(&self, field: &ChoiceField) -> Result<Tried, RunError> {
        let grid = TrialGrid::new(self.frame, LIGHTS_TRIED);
        let notes = Notes::default();
        let sampler = |guide| self.sampler(Training { guide, notes });
        let paths = TrialPaths {
            plain: sampler(None),
            told: sampler(Some(Guided::by_lights(field))),
            grid: &grid,
        };
        paths.run(self.tracer)
    }

    /// A field of all records.
    pub(super) fn fit(&self) -> Option<GatherField> {
        GatherField::fit(&self.records)
    }

    fn sampler<'s>(
        &'s self,
        training: Training<'s>,
    ) -> PixelSampler<'s, CUTOUTS, M, Training<'s>, Unmerged> {
        PixelSampler {
            frame: self.frame,
            integrator: self.integrator.guided_by(training),
        }
    }
}
