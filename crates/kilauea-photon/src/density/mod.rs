//! Irradiance from the density of photons around a place.

mod batch;
mod kernel;
mod nearest;
mod rule;
mod within;

pub(crate) use batch::in_curve_order;
pub use kernel::Kernel;
pub use nearest::NearPhoton;
pub(crate) use nearest::irradiance_of_nearest;
pub use rule::{DensityRule, RadiusRule};

use kilauea_math::{Spectrum, Vec3};

use crate::PhotonMap;

/// A place on a surface where the density of photons is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceQuery {
    /// The place.
    pub p: Vec3,
    /// Unit geometric normal, on the side that is asked for.
    pub n: Vec3,
}

/// What the photons around a place say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Irradiance {
    /// In W/m².
    pub value: Spectrum,
    /// Number of photons that it is from.
    pub n_photons: u32,
}

impl PhotonMap {
    /// Irradiance at a place, with the radius that `radius` says.
    pub fn irradiance_by(
        &self,
        query: &SurfaceQuery,
        radius: RadiusRule,
        rule: &DensityRule,
    ) -> Irradiance {
        match radius {
            RadiusRule::Fixed(radius) => self.irradiance(query, radius, rule),
            RadiusRule::Nearest { k, max_radius } => {
                self.irradiance_by_nearest(query, k, max_radius, rule)
            }
        }
    }
}
