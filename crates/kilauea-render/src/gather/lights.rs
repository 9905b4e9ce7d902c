//! Whether lights are chosen by what they bring in each cell.

use kilauea_gather::{ChoiceField, PathError, forecast_choice};
use kilauea_spot::RunError;

use super::pilot::Pilot;
use super::trainer::Trainer;
use super::{LEAST_GAIN, relative_cost};
use crate::frame::Frame;
use crate::integrator::Media;
use crate::stats::GatherStats;

/// Time of a ray of a path that chooses lights by cells, over that of one of a plain path, as measured
/// where there is little else to do (decision 026).
const CHOICE_COST: f32 = 1.15;
/// Less that records promise is not worth a trial.
const LEAST_FORECAST: f32 = 1.10;
/// Pixels of a trial that would tell as much as the forecast does.
const PRIOR_PIXELS: f32 = 64.0;

impl Frame {
    /// Whether records of choices promise so much that it is worth looking closer.
    pub(super) fn hopes_for_lights<const CUTOUTS: bool, M: Media>(
        &self,
        trainer: &Trainer<'_, '_, CUTOUTS, M>,
        pilot: &Pilot,
        found: &mut GatherStats,
    ) -> bool {
        let choices = &trainer.choices;
        found.choices = choices.len() as u64;
        let forecast = forecast_choice(choices, &pilot.picture, pilot.plain, pilot.n_paths);
        if let Some(forecast) = forecast {
            found.choices_in_vain = forecast.in_vain;
            found.forecast_of_lights = forecast.gain;
        }
        found.forecast_of_lights >= LEAST_GAIN || self.needs.guided_lights
    }

    /// What lights bring in each cell, where choosing them by that pays.
    pub(super) fn learn_lights<const CUTOUTS: bool, M: Media>(
        &self,
        trainer: &Trainer<'_, '_, CUTOUTS, M>,
        pilot: &Pilot,
        found: &mut GatherStats,
    ) -> Result<Option<ChoiceField>, RunError> {
        let is_forced = self.needs.guided_lights;
        if found.forecast_of_lights < LEAST_FORECAST && !is_forced {
            return Ok(None);
        }
        let Some(field) = ChoiceField::fit(&trainer.choices, &pilot.picture) else {
            return Ok(None);
        };
        let tried = trainer.try_lights(&field)?;
        let n_pixels = tried.plain.len() / 2;
        found.pixels_tried = n_pixels as u64;
        if let Some(errors) = tried.errors(&pilot.picture) {
            found.gain_of_lights = believed(found.forecast_of_lights, errors, n_pixels);
        }
        let pays = found.gain_of_lights >= LEAST_GAIN * CHOICE_COST;
        Ok((pays || is_forced).then_some(field))
    }
}

/// What is gained by choosing lights by cells: what a trial of so many pixels says, and the less there
/// are of them the more what `forecast` says, which is the most that can be gained. What samples share
/// out is between none of that and all, so that its root is taken.
fn believed(forecast: f32, [plain, told]: [PathError; 2], n_pixels: usize) -> f32 {
    let tried = plain.relative_variance / told.relative_variance / relative_cost(plain, told, 1.0);
    if !(tried > 0.0 && tried.is_finite()) {
        return 1.0;
    }
    let weight = n_pixels as f32 / (n_pixels as f32 + PRIOR_PIXELS);
    let before = 0.5 * forecast.max(1.0).ln();
    (weight * tried.ln() + (1.0 - weight) * before).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(relative_variance: f32, n_rays: f32) -> PathError {
        PathError {
            relative_variance,
            n_rays,
        }
    }

    #[test]
    fn the_more_pixels_the_more_a_trial_is_believed() {
        let gain = |n| believed(1.44, [error(3.0, 4.0), error(1.5, 4.0)], n);
        assert!((gain(0) - 1.2).abs() < 1e-6, "{}", gain(0));
        assert!(gain(0) < gain(64) && gain(64) < gain(1000), "{}", gain(64));
        assert!((gain(1_000_000) - 2.0).abs() < 1e-3);
        // Twice the rays for half the variance.
        let gain = believed(1.44, [error(3.0, 4.0), error(1.5, 9.0)], 1_000_000);
        assert!((gain - 1.0).abs() < 1e-3, "{gain}");
    }

    #[test]
    fn a_trial_that_saw_nothing_gains_nothing() {
        for told in [error(0.0, 1.0), error(f32::NAN, 1.0)] {
            assert_eq!(believed(1.5, [error(0.0, 1.0), told], 100), 1.0);
        }
    }
}
