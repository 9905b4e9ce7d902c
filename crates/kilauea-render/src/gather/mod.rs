//! Final-gather estimation: passes of paths whose light is not shown, but recorded for the paths
//! after them.

#[cfg(test)]
mod spoiled;
mod trainer;
mod training_pass;

use kilauea_gather::{GatherField, PathError, PictureEstimate};
use kilauea_spot::RunError;

use crate::frame::Frame;
use crate::integrator::{Guided, Means, Media, PathIntegrator, RayTracer};
use crate::stats::GatherStats;
use trainer::Trainer;

/// What is known before the final paths.
pub(crate) struct GatherEstimate {
    field: GatherField,
    picture: PictureEstimate,
    error: PathError,
    means: Means,
}

const DIRECTIONS: Means = Means {
    directions: true,
    roulette: false,
};
const ROULETTE: Means = Means {
    directions: false,
    roulette: true,
};
const BOTH: Means = Means {
    directions: true,
    roulette: true,
};
/// Plain paths are left for what is at least so much more efficient.
const LEAST_GAIN: f32 = 1.05;
/// Where guided paths of a field that was made from few are worse than that, more will not help.
const HOPELESS: f32 = 0.9;

impl GatherEstimate {
    /// What guides final paths; none where plain ones are as good.
    pub(crate) fn guide(&self) -> Option<Guided<'_>> {
        (self.means != Means::default()).then_some(self.guide_by(self.means, self.error))
    }

    fn guide_by(&self, means: Means, error: PathError) -> Guided<'_> {
        Guided {
            field: &self.field,
            picture: &self.picture,
            error,
            means,
        }
    }
}

impl Frame {
    /// Trains on paths, and finds out by them what of it pays. None where they found no light.
    ///
    /// Passes of plain and of guided paths, the latter longer each time (Müller et al. 2017), leave
    /// records. Those of paths that end early only tell whether that pays.
    pub(crate) fn estimate_gather<const CUTOUTS: bool, M: Media>(
        &self,
        integrator: PathIntegrator<'_, CUTOUTS, M>,
        tracer: &RayTracer<'_, CUTOUTS>,
    ) -> Result<Option<GatherEstimate>, RunError> {
        let mut trainer = Trainer::new(self, integrator, tracer);
        let samples = trainer.run(1, None)?;
        let window = self.film.data_window();
        let Some(picture) = PictureEstimate::fit(window.min, window.max, &samples) else {
            return Ok(None);
        };
        let plain = picture.error_of(&samples);
        let (Some(plain), Some(field)) = (plain, trainer.fit()) else {
            return Ok(None);
        };
        let mut estimate = GatherEstimate {
            field,
            picture,
            error: plain,
            means: Means::default(),
        };
        let gain =
            |error: PathError, means: Means| efficiency(plain, Means::default(), error, means);
        let mut tried = GatherStats::default();
        let mut best = LEAST_GAIN;

        let mut guided = trainer.error(2, &estimate, DIRECTIONS, plain)?;
        tried.efficiency_of_directions = gain(guided, DIRECTIONS);
        estimate.field = trainer.fit().unwrap_or(estimate.field);
        if tried.efficiency_of_directions > HOPELESS {
            guided = trainer.error(4, &estimate, DIRECTIONS, plain)?;
            tried.efficiency_of_directions = gain(guided, DIRECTIONS);
            estimate.field = trainer.fit().unwrap_or(estimate.field);
        }
        let ended = trainer.error(1, &estimate, ROULETTE, plain)?;
        tried.efficiency_of_roulette = gain(ended, ROULETTE);
        let mut both = guided;
        if tried.efficiency_of_directions > HOPELESS {
            both = trainer.error(1, &estimate, BOTH, guided)?;
            tried.efficiency_of_both = gain(both, BOTH);
        }
        for (gain, means, error) in [
            (tried.efficiency_of_directions, DIRECTIONS, guided),
            (tried.efficiency_of_roulette, ROULETTE, ended),
            (tried.efficiency_of_both, BOTH, both),
        ] {
            if gain >= best {
                (best, estimate.means, estimate.error) = (gain, means, error);
            }
        }
        estimate.means.directions |= self.needs.guided_directions;
        estimate.means.roulette |= self.needs.residual_roulette;
        let mut outcome = self.lock_outcome();
        outcome.means = estimate.means;
        outcome.gather = GatherStats {
            paths: trainer.n_paths,
            records: trainer.records.len() as u64,
            cells: estimate.field.n_cells() as u64,
            bytes: estimate.field.n_bytes() as u64,
            ..tried
        };
        drop(outcome);
        Ok(Some(estimate))
    }
}

/// Efficiency of paths relative to others.
fn efficiency(of: PathError, of_means: Means, error: PathError, means: Means) -> f32 {
    let cost = |error: PathError, means: Means| {
        let lookups = if means.directions { GUIDED_COST } else { 1.0 };
        1.0 + error.n_rays * lookups
    };
    of.relative_variance * cost(of, of_means) / (error.relative_variance * cost(error, means))
}

/// Time of a guided path over that of a plain path of as many rays; measured in `03_window`, rounded
/// down by what training took of it.
const GUIDED_COST: f32 = 1.3;
