//! Final-gather estimation: passes of paths whose light is not shown, but recorded for the paths
//! after them.

#[cfg(test)]
mod spoiled;
mod trainer;
mod training_pass;

use kilauea_gather::{GatherField, PathError, PictureEstimate, forecast};
use kilauea_spot::RunError;

use crate::frame::Frame;
use crate::integrator::{GUIDED_SHARE, Guided, Media, PathIntegrator, RayTracer};
use crate::stats::GatherStats;
use trainer::Trainer;

/// Plain paths are left for guided ones that are at least so much more efficient.
const LEAST_GAIN: f32 = 1.05;
/// Where guided paths of a field that was made from few gain no more, more will not help.
const HOPELESS: f32 = 1.0;
/// Time of a guided path over that of a plain path of as many rays; measured in `03_window`, rounded
/// down by what training took of it.
const GUIDED_COST: f32 = 1.3;

impl Frame {
    /// Where light comes from, by paths that found it; none where that does not pay.
    ///
    /// Records of a first pass of plain paths forecast whether directions from cells would. Only then
    /// passes of guided paths, the second longer (Müller et al. 2017), leave more records, and tell
    /// whether they do.
    pub(crate) fn estimate_gather<const CUTOUTS: bool, M: Media>(
        &self,
        integrator: PathIntegrator<'_, CUTOUTS, M>,
        tracer: &RayTracer<'_, CUTOUTS>,
    ) -> Result<Option<GatherField>, RunError> {
        let Some(mut trainer) = Trainer::new(self, integrator, tracer) else {
            return Ok(None);
        };
        let mut tried = GatherStats::default();
        let field = self.train(&mut trainer, &mut tried)?;
        let pays = tried.efficiency_of_directions >= LEAST_GAIN;
        let mut outcome = self.lock_outcome();
        outcome.gather = GatherStats {
            paths: trainer.n_paths,
            records: trainer.records.len() as u64,
            cells: field.as_ref().map_or(0, GatherField::n_cells) as u64,
            bytes: field.as_ref().map_or(0, GatherField::n_bytes) as u64,
            ..tried
        };
        let field = field.filter(|_| pays || self.needs.guided_directions);
        outcome.is_guided = field.is_some();
        Ok(field)
    }

    /// A field of what paths found, if there is reason to hope for anything from it, and what was
    /// found out about that.
    fn train<const CUTOUTS: bool, M: Media>(
        &self,
        trainer: &mut Trainer<'_, '_, CUTOUTS, M>,
        tried: &mut GatherStats,
    ) -> Result<Option<GatherField>, RunError> {
        let is_forced = self.needs.guided_directions;
        let samples = trainer.run(1, None)?;
        let window = self.film.data_window();
        let Some(picture) = PictureEstimate::fit(window.min, window.max, &samples) else {
            return Ok(None);
        };
        let Some(plain) = picture.error_of(&samples) else {
            return Ok(None);
        };
        tried.forecast = forecast(&trainer.records, &picture, GUIDED_SHARE).unwrap_or(0.0);
        if tried.forecast <= HOPELESS && !is_forced {
            return Ok(None);
        }
        let mut field = trainer.fit();
        for length in [2, 4] {
            let Some(guide) = field.as_ref().map(|field| Guided { field }) else {
                break;
            };
            let samples = trainer.run(length, Some(guide))?;
            if let Some(guided) = picture.error_of(&samples) {
                tried.efficiency_of_directions = efficiency(plain, guided);
            }
            if tried.efficiency_of_directions <= HOPELESS && !is_forced {
                break;
            }
            field = trainer.fit();
        }
        Ok(field)
    }
}

/// Efficiency of guided paths relative to plain ones.
fn efficiency(plain: PathError, guided: PathError) -> f32 {
    let cost = |error: PathError, lookups: f32| 1.0 + error.n_rays * lookups;
    plain.relative_variance * cost(plain, 1.0)
        / (guided.relative_variance * cost(guided, GUIDED_COST))
}
