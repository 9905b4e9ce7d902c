//! Whether directions are drawn from where light came from in each cell.

use kilauea_gather::{GatherField, forecast};
use kilauea_spot::RunError;

use super::pilot::Pilot;
use super::trainer::Trainer;
use super::{LEAST_GAIN, relative_cost};
use crate::frame::Frame;
use crate::integrator::{GUIDED_SHARE, Guided, Media, Notes};
use crate::stats::GatherStats;

/// Where guided paths of a field that was made from few gain no more, more will not help.
const HOPELESS: f32 = 1.0;
/// Time of a guided path over that of a plain path of as many rays; measured in `03_window`, rounded
/// down by what training took of it.
const GUIDED_COST: f32 = 1.3;

impl Frame {
    /// Whether records of plain paths promise that cells know where light comes from.
    pub(super) fn hopes_for_directions<const CUTOUTS: bool, M: Media>(
        &self,
        trainer: &Trainer<'_, '_, CUTOUTS, M>,
        pilot: &Pilot,
        found: &mut GatherStats,
    ) -> bool {
        let forecast = forecast(&trainer.records, &pilot.picture, GUIDED_SHARE);
        found.forecast = forecast.unwrap_or(0.0);
        found.forecast > HOPELESS || self.needs.guided_directions
    }

    /// Where light comes from in each cell, where drawing directions from that pays. It is tried by
    /// passes of guided paths, the second longer (Müller et al. 2017), which leave more records.
    pub(super) fn learn_directions<const CUTOUTS: bool, M: Media>(
        &self,
        trainer: &mut Trainer<'_, '_, CUTOUTS, M>,
        pilot: &Pilot,
        found: &mut GatherStats,
    ) -> Result<Option<GatherField>, RunError> {
        let is_forced = self.needs.guided_directions;
        let notes = Notes {
            directions: true,
            lights: false,
        };
        let mut field = trainer.fit();
        for length in [2.0, 4.0] {
            let Some(guide) = field.as_ref().map(Guided::by_directions) else {
                break;
            };
            let samples = trainer.run(length * trainer.pilot_paths, Some(guide), notes)?;
            if let Some(guided) = pilot.picture.error_of(&samples) {
                found.efficiency_of_directions = pilot.plain.relative_variance
                    / guided.relative_variance
                    / relative_cost(pilot.plain, guided, GUIDED_COST);
            }
            if found.efficiency_of_directions <= HOPELESS && !is_forced {
                break;
            }
            field = trainer.fit();
        }
        let pays = found.efficiency_of_directions >= LEAST_GAIN || is_forced;
        Ok(field.filter(|_| pays))
    }
}
