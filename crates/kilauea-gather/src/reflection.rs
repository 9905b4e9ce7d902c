use kilauea_math::Spectrum;

use crate::record::GatherRecord;

/// What surfaces of a cell reflect of the light that comes along paths, not from lights that were
/// chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflection {
    /// Mean of [`GatherRecord::radiance`]: radiance per albedo.
    pub radiance: Spectrum,
    /// What the next path from here is worth: the root of its mean squared luminance less that
    /// mean, per albedo, over that of the rays that it takes.
    pub urgency: f32,
}

impl Reflection {
    /// Fits to the records of a cell, of which there is at least one.
    pub(crate) fn fit(records: &[&GatherRecord]) -> Self {
        let per_record = 1.0 / records.len() as f32;
        let mut radiance = Spectrum::BLACK;
        let mut n_rays = 0.0;
        for record in records {
            radiance += record.radiance * per_record;
            n_rays += record.n_rays * per_record;
        }
        let residual_sq = |record: &&GatherRecord| {
            let residual = (record.radiance - radiance).luminance();
            residual * residual * per_record
        };
        let residual_sq: f32 = records.iter().map(residual_sq).sum();
        Self {
            radiance,
            urgency: (residual_sq / n_rays.max(1.0)).sqrt(),
        }
    }
}
