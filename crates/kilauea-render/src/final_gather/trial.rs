//! A trial: all samples of a few pixels, by paths that look irradiance up and by others.

use kilauea_gather::{PictureEstimate, SquaredDifference};

use super::IrradianceCache;
use crate::RenderError;
use crate::frame::Frame;
use crate::gather::trial::{TrialGrid, TrialPaths, Tried};
use crate::gather::{GatherEstimate, relative_cost};
use crate::integrator::{Guided, Notes, Training, Unmerged};
use crate::samples::PixelSampler;

/// Time of a ray of a path that looks irradiance up, over that of one of another path (decision 027).
const GATHERING_COST: f32 = 1.4;
/// Time of a ray of a photon, over the same, what is made of the photon included.
const PHOTON_COST: f64 = 4.0;
/// Tells this trial from others.
const GATHERING_TRIED: u32 = 1;

/// What paths that look irradiance up bring, relative to the picture, over all its pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Benefit {
    /// Variance of a pixel without.
    plain_variance: f64,
    /// Variance of a pixel with it.
    variance: f64,
    /// Squared difference of what is expected of a pixel.
    pub(super) squared_bias: SquaredDifference,
    /// Time of paths over that without.
    relative_cost: f64,
    /// Time of photons over that of paths without.
    cost_of_photons: f64,
}

impl Benefit {
    /// Efficiency with `1 / share` times the photons, over that without.
    ///
    /// Records are of as many photons then, and their discs smaller by that share: so is the part of
    /// the picture near edges. What is blurred falls faster, and the error by chance as so many more
    /// records are looked up.
    pub(super) fn gain(&self, share: f64) -> f64 {
        // Where light is hard to find, bias that there is not looks like much by chance.
        let SquaredDifference {
            value,
            standard_error,
        } = self.squared_bias;
        let squared_bias = (value - standard_error).max(0.0) * share;
        // To look up what would be found by chance takes variance away, and records of fifty photons add
        // some hundredths of it. Where it seems to grow, plain paths had bright samples that were cut off,
        // or have not had them yet.
        let plain_variance = self.plain_variance.max(self.variance);
        let relative_cost = self.relative_cost + self.cost_of_photons / share;
        plain_variance / (self.variance * relative_cost + squared_bias)
    }
}

impl Frame {
    /// Tries in some pixels what looking up brings; none where nothing is seen.
    pub(super) fn try_gathering(
        &self,
        irradiance: &IrradianceCache,
        learnt: &GatherEstimate,
    ) -> Result<Option<Benefit>, RenderError> {
        let grid = TrialGrid::new(self, GATHERING_TRIED);
        let guide = Training {
            guide: Some(Guided {
                field: learnt.directions.as_ref(),
                aims: None,
                lights: learnt.lights(),
            }),
            notes: Notes::default(),
        };
        let integrator = self
            .integrator::<true, _>(self.camera_media())
            .guided_by(guide);
        let paths = TrialPaths {
            plain: PixelSampler {
                frame: self,
                integrator,
            },
            told: PixelSampler {
                frame: self,
                integrator: integrator.merging_by(irradiance.gather(self, Unmerged)),
            },
            grid: &grid,
        };
        let tried = match paths.run(&self.tracer()) {
            Ok(tried) => tried,
            Err(error) => {
                self.stopped_by(error)?;
                Tried::default()
            }
        };
        Ok(self.benefit(&grid, &tried, irradiance.n_rays))
    }

    fn benefit(&self, grid: &TrialGrid, tried: &Tried, n_photon_rays: u64) -> Option<Benefit> {
        let window = self.film.data_window();
        let picture = PictureEstimate::fit(window.min, window.max, &tried.plain)?;
        let [plain, told] = tried.errors(&picture)?;
        // Those that are tried have no more samples than a trial takes.
        let share = f64::from(grid.n_samples) / f64::from(self.settings.samples_per_pixel);
        let n_paths = self.n_pixels as f64 * f64::from(self.settings.samples_per_pixel);
        let n_rays = n_paths * f64::from(1.0 + plain.n_rays);
        Some(Benefit {
            plain_variance: f64::from(plain.relative_variance) * share,
            variance: f64::from(told.relative_variance) * share,
            squared_bias: picture.squared_difference(&tried.plain, &tried.told)?,
            relative_cost: relative_cost(plain, told, GATHERING_COST).into(),
            cost_of_photons: PHOTON_COST * n_photon_rays as f64 / n_rays,
        })
    }
}
