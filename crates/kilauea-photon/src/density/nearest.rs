use std::num::NonZeroUsize;

use kilauea_math::Spectrum;

use super::{DensityRule, Irradiance, Kernel, SurfaceQuery};
use crate::{Found, PhotonMap};

/// As much of a photon near a place as an estimate needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearPhoton {
    /// Squared distance.
    pub d_sq: f32,
    /// Flux in W.
    pub power: Spectrum,
}

impl PhotonMap {
    /// The `k` nearest photons that the rule accepts, at most `max_radius` away, nearest first.
    pub fn nearest_on_surface(
        &self,
        query: &SurfaceQuery,
        k: NonZeroUsize,
        max_radius: f32,
        rule: &DensityRule,
    ) -> Vec<NearPhoton> {
        let found = self.nearest_where(query.p, k, max_radius, |photon, d_sq| {
            rule.accepts(query, photon, d_sq)
        });
        let near = |f: Found| NearPhoton {
            d_sq: f.d_sq,
            power: self.photon(f.idx as usize).power(),
        };
        found.into_iter().map(near).collect()
    }

    /// Irradiance at a place, within the radius that holds `k` photons, or `max_radius` if there are
    /// fewer.
    pub fn irradiance_by_nearest(
        &self,
        query: &SurfaceQuery,
        k: NonZeroUsize,
        max_radius: f32,
        rule: &DensityRule,
    ) -> Irradiance {
        let near = self.nearest_on_surface(query, k, max_radius, rule);
        irradiance_of_nearest(&near, k, max_radius, rule.kernel)
    }
}

/// Irradiance from photons in ascending order of their distances: those nearer than the `k`-th, in
/// its distance. The `k`-th itself only says how far they reach: with it in the sum, the estimate
/// would be k / (k - 1) times too high (García Hernández et al. 2012).
pub(crate) fn irradiance_of_nearest(
    near: &[NearPhoton],
    k: NonZeroUsize,
    max_radius: f32,
    kernel: Kernel,
) -> Irradiance {
    let (inner, radius_sq) = match near.get(k.get() - 1) {
        Some(farthest) => (&near[..k.get() - 1], farthest.d_sq),
        None => (near, max_radius * max_radius),
    };
    Irradiance {
        value: inner
            .iter()
            .map(|photon| photon.power * kernel.weight(photon.d_sq, radius_sq))
            .sum(),
        n_photons: inner.len() as u32,
    }
}
