use super::{DensityRule, Irradiance, SurfaceQuery};
use crate::PhotonMap;

impl PhotonMap {
    /// Irradiance at a place, E = Σ Φᵢ K(dᵢ): the flux of the photons within `radius` that the rule
    /// accepts, by area (Jensen 1996, with a fixed radius as in Hachisuka et al. 2008).
    ///
    /// The sum is in the order of the map, whatever else is asked for.
    pub fn irradiance(&self, query: &SurfaceQuery, radius: f32, rule: &DensityRule) -> Irradiance {
        let radius_sq = radius * radius;
        let mut found = Irradiance::default();
        self.for_each_within(query.p, radius, |photon, d_sq| {
            if rule.accepts(query, photon, d_sq) {
                found.value += photon.power() * rule.kernel.weight(d_sq, radius_sq);
                found.n_photons += 1;
            }
        });
        found
    }
}
