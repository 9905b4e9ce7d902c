//! Final-gather estimation: passes of paths whose light is not shown, but recorded for the paths
//! after them.

mod directions;
mod found_wire;
mod lights;
mod picture;
mod pilot;
mod pixel_grid;
mod report;
mod skipped;
#[cfg(test)]
mod spoiled;
mod trainer;
mod training_pass;
pub(crate) mod trial;

use std::sync::Arc;
use std::time::Instant;

use kilauea_gather::{ChoiceField, GatherField, PathError};
use kilauea_scene::RenderSettings;
use kilauea_spot::RunError;
use serde::{Deserialize, Serialize};

use crate::RenderError;
use crate::conditions::Conditions;
use crate::frame::Frame;
use crate::integrator::{Media, Notes, PathIntegrator, RayTracer};
use crate::light::ByCells;
use crate::prepared::PreparedScene;
use crate::stats::GatherStats;
pub use picture::{EstimateLayer, estimate_picture};
use pilot::Pilot;
pub use report::EstimateReport;
use trainer::Trainer;

/// Plain paths are left for others that are at least so much more efficient.
const LEAST_GAIN: f32 = 1.05;

/// What is known of the light before final paths are traced, as far as it pays. Whatever it says, it
/// changes no expectation.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GatherEstimate {
    /// Where light comes from.
    pub(crate) directions: Option<GatherField>,
    /// Which lights bring it.
    lights: Option<ChoiceField>,
    /// What the pilot found that told so.
    pub(crate) found: GatherStats,
}

impl GatherEstimate {
    /// What the pilot of a frame tells, without the frame.
    ///
    /// # Errors
    /// If a setting is not sound or a shader panics.
    pub fn of(prepared: Arc<PreparedScene>, settings: RenderSettings) -> Result<Self, RenderError> {
        let frame = Frame::new(Conditions::default(), prepared, settings)?;
        let geometry = &frame.prepared.geometry;
        frame
            .learn()
            .map_err(|error| RenderError::of_run(error, &frame.blame, geometry))
    }

    /// How lights are chosen.
    pub(crate) fn lights(&self) -> ByCells<'_> {
        ByCells {
            field: self.lights.as_ref(),
        }
    }

    /// Whether lights are chosen by it.
    pub(crate) fn knows_lights(&self) -> bool {
        self.lights.is_some()
    }

    /// Notes what it is made of, and how much there is of it.
    fn count(&mut self, n_paths: u64, n_records: usize) {
        let (directions, lights) = (&self.directions, &self.lights);
        let n_bytes = directions.as_ref().map_or(0, GatherField::n_bytes)
            + lights.as_ref().map_or(0, ChoiceField::n_bytes);
        self.found = GatherStats {
            paths: n_paths,
            records: n_records as u64,
            cells: directions.as_ref().map_or(0, GatherField::n_cells) as u64,
            light_cells: lights.as_ref().map_or(0, ChoiceField::n_cells) as u64,
            bytes: n_bytes as u64,
            ..self.found
        };
    }
}

impl Frame {
    /// What its pilot tells.
    pub(crate) fn learn(&self) -> Result<GatherEstimate, RunError> {
        let integrator = self.integrator::<true, _>(self.camera_media());
        self.estimate_gather(integrator, &self.tracer())
    }

    /// Learns from a pilot of plain paths what pays: which lights are worth choosing,
    /// and where light comes from.
    ///
    /// Their records forecast whether either would pay. A first part of the pilot is all where there
    /// is nothing to hope for; what there is hope for is tried as well.
    fn estimate_gather<const CUTOUTS: bool, M: Media>(
        &self,
        integrator: PathIntegrator<'_, CUTOUTS, M>,
        tracer: &RayTracer<'_, CUTOUTS>,
    ) -> Result<GatherEstimate, RunError> {
        let start = Instant::now();
        let Some(mut trainer) = Trainer::new(self, integrator, tracer) else {
            return Ok(GatherEstimate::default());
        };
        let mut estimate = GatherEstimate::default();
        let found = &mut estimate.found;
        if let Some((pilot, hopes)) = self.look(&mut trainer, found)? {
            if hopes.lights {
                estimate.lights = self.learn_lights(&trainer, &pilot, found)?;
            }
            if hopes.directions {
                estimate.directions = self.learn_directions(&mut trainer, &pilot, found)?;
            }
        }
        estimate.count(trainer.n_paths, trainer.records.len());
        self.lock_outcome().gather_secs = start.elapsed().as_secs_f64();
        Ok(estimate)
    }

    /// Traces the pilot, or the first part of it. Returns what it tells, and what there is to hope
    /// for; none where nothing is seen.
    fn look<const CUTOUTS: bool, M: Media>(
        &self,
        trainer: &mut Trainer<'_, '_, CUTOUTS, M>,
        found: &mut GatherStats,
    ) -> Result<Option<(Pilot, Notes)>, RunError> {
        let mut hopes = Notes {
            directions: true,
            lights: true,
        };
        let mut samples = Vec::new();
        let mut seen = None;
        let mut looks = trainer.looks().peekable();
        while let Some(n_paths) = looks.next() {
            samples.extend(trainer.run(n_paths, None, hopes)?);
            let Some(pilot) = Pilot::of(self, &samples) else {
                return Ok(None);
            };
            hopes = Notes {
                // A few hundred paths tell too little of a thousand lights: the last look decides.
                lights: hopes.lights
                    && match looks.peek() {
                        Some(_) => !trainer.choices.is_empty() || self.needs.guided_lights,
                        None => self.hopes_for_lights(trainer, &pilot, found),
                    },
                directions: hopes.directions && self.hopes_for_directions(trainer, &pilot, found),
            };
            seen = Some((pilot, hopes));
            if hopes == Notes::default() {
                break;
            }
        }
        Ok(seen)
    }
}

/// What paths cost over what plain ones do, where each of their rays takes `cost_of_ray` times as long.
pub(crate) fn relative_cost(plain: PathError, told: PathError, cost_of_ray: f32) -> f32 {
    (1.0 + told.n_rays * cost_of_ray) / (1.0 + plain.n_rays)
}
