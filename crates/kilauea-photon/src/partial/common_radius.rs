use super::PartialMap;
use crate::{DensityRule, Irradiance, SurfaceQuery};

/// The sum of what the parts have within one radius.
///
/// A fixed radius makes the estimate linear in the photons, so the sum is that of one map, whatever
/// the shares are. It is taken in the order of the parts, so that arrival does not matter.
pub fn common_radius<P: PartialMap>(
    parts: &[P],
    query: &SurfaceQuery,
    radius: f32,
    rule: &DensityRule,
) -> Irradiance {
    let mut sum = Irradiance::default();
    for part in parts {
        let found = part.within(query, radius, rule);
        sum.value += found.value;
        sum.n_photons += found.n_photons;
    }
    sum
}
