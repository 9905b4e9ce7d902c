//! Final-gather estimation: passes of paths whose light is not shown, but recorded for the paths
//! after them.

#[cfg(test)]
mod spoiled;
mod trainer;
mod training_pass;

use kilauea_gather::{
    ChoiceField, GatherField, PathError, PictureEstimate, PictureSample, forecast, forecast_choice,
};
use kilauea_spot::RunError;

use crate::frame::Frame;
use crate::integrator::{GUIDED_SHARE, Guided, Media, PathIntegrator, RayTracer};
use crate::light::ByCells;
use crate::stats::GatherStats;
use trainer::Trainer;

/// Plain paths are left for guided ones that are at least so much more efficient.
const LEAST_GAIN: f32 = 1.05;
/// Where guided paths of a field that was made from few gain no more, more will not help.
const HOPELESS: f32 = 1.0;
/// Time of a path that chooses lights by cells over that of a plain one; measured in `many_lights`, with
/// what a pilot takes of a short frame.
const CHOICE_COST: f32 = 1.1;
/// Time of a guided path over that of a plain path of as many rays; measured in `03_window`, rounded
/// down by what training took of it.
const GUIDED_COST: f32 = 1.3;

/// What is known of the light before final paths are traced, as far as it pays.
#[derive(Default)]
pub(crate) struct GatherEstimate {
    /// Where light comes from.
    directions: Option<GatherField>,
    /// Which lights bring it.
    lights: Option<ChoiceField>,
}

impl GatherEstimate {
    /// What paths are told of it; none where nothing pays.
    pub(crate) fn guide(&self) -> Option<Guided<'_>> {
        let is_any = self.directions.is_some() || self.lights.is_some();
        is_any.then_some(Guided {
            field: self.directions.as_ref(),
            lights: ByCells {
                field: self.lights.as_ref(),
            },
        })
    }
}

impl Frame {
    /// Learns from a pilot of plain paths: which lights are worth choosing, and where light comes from.
    ///
    /// Their records forecast whether either would pay. Guided directions are tried as well: passes
    /// of guided paths, the second longer (Müller et al. 2017), leave more records, and tell whether
    /// they do.
    pub(crate) fn estimate_gather<const CUTOUTS: bool, M: Media>(
        &self,
        integrator: PathIntegrator<'_, CUTOUTS, M>,
        tracer: &RayTracer<'_, CUTOUTS>,
    ) -> Result<GatherEstimate, RunError> {
        let Some(mut trainer) = Trainer::new(self, integrator, tracer) else {
            return Ok(GatherEstimate::default());
        };
        let mut tried = GatherStats::default();
        let mut estimate = GatherEstimate::default();
        let samples = trainer.run(1, None)?;
        if let Some(pilot) = Pilot::of(self, &samples) {
            estimate.lights = self.learn_lights(&trainer, &pilot, &mut tried);
            estimate.directions = self.learn_directions(&mut trainer, &pilot, &mut tried)?;
        }
        let GatherEstimate { directions, lights } = &estimate;
        let mut outcome = self.lock_outcome();
        outcome.gather = GatherStats {
            paths: trainer.n_paths,
            records: trainer.records.len() as u64,
            cells: directions.as_ref().map_or(0, GatherField::n_cells) as u64,
            light_cells: lights.as_ref().map_or(0, ChoiceField::n_cells) as u64,
            bytes: (directions.as_ref().map_or(0, GatherField::n_bytes)
                + lights.as_ref().map_or(0, ChoiceField::n_bytes)) as u64,
            ..tried
        };
        outcome.guides_directions = directions.is_some();
        outcome.guides_lights = lights.is_some();
        drop(outcome);
        Ok(estimate)
    }

    /// What lights bring in each cell, where choosing them by that pays.
    fn learn_lights<const CUTOUTS: bool, M: Media>(
        &self,
        trainer: &Trainer<'_, '_, CUTOUTS, M>,
        pilot: &Pilot,
        tried: &mut GatherStats,
    ) -> Option<ChoiceField> {
        let Pilot {
            picture,
            plain,
            n_paths,
        } = pilot;
        let choices = &trainer.choices;
        tried.choices = choices.len() as u64;
        let forecast = forecast_choice(
            choices,
            picture,
            *plain,
            *n_paths,
            self.settings.samples_per_pixel,
        )?;
        tried.choices_in_vain = forecast.in_vain;
        tried.forecast_of_lights = forecast.gain;
        let pays = forecast.gain >= LEAST_GAIN * CHOICE_COST || self.needs.guided_lights;
        pays.then(|| ChoiceField::fit(choices, picture)).flatten()
    }

    /// Where light comes from in each cell, where drawing directions from that pays.
    fn learn_directions<const CUTOUTS: bool, M: Media>(
        &self,
        trainer: &mut Trainer<'_, '_, CUTOUTS, M>,
        pilot: &Pilot,
        tried: &mut GatherStats,
    ) -> Result<Option<GatherField>, RunError> {
        let Pilot { picture, plain, .. } = pilot;
        let is_forced = self.needs.guided_directions;
        tried.forecast = forecast(&trainer.records, picture, GUIDED_SHARE).unwrap_or(0.0);
        if tried.forecast <= HOPELESS && !is_forced {
            return Ok(None);
        }
        let mut field = trainer.fit();
        for length in [2, 4] {
            let Some(guide) = field.as_ref().map(Guided::by_directions) else {
                break;
            };
            let samples = trainer.run(length, Some(guide))?;
            if let Some(guided) = picture.error_of(&samples) {
                tried.efficiency_of_directions = efficiency(*plain, guided);
            }
            if tried.efficiency_of_directions <= HOPELESS && !is_forced {
                break;
            }
            field = trainer.fit();
        }
        let pays = tried.efficiency_of_directions >= LEAST_GAIN || is_forced;
        Ok(field.filter(|_| pays))
    }
}

/// What a pass of plain paths tells of the picture.
struct Pilot {
    picture: PictureEstimate,
    /// Error of one of its paths.
    plain: PathError,
    n_paths: usize,
}

impl Pilot {
    /// None where nothing is seen.
    fn of(frame: &Frame, samples: &[PictureSample]) -> Option<Self> {
        let window = frame.film.data_window();
        let picture = PictureEstimate::fit(window.min, window.max, samples)?;
        let plain = picture.error_of(samples)?;
        Some(Self {
            picture,
            plain,
            n_paths: samples.len(),
        })
    }
}

/// Efficiency of guided paths relative to plain ones.
fn efficiency(plain: PathError, guided: PathError) -> f32 {
    let cost = |error: PathError, lookups: f32| 1.0 + error.n_rays * lookups;
    plain.relative_variance * cost(plain, 1.0)
        / (guided.relative_variance * cost(guided, GUIDED_COST))
}
