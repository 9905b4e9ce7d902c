use std::f32::consts::PI;
use std::num::NonZeroUsize;

use kilauea_math::Spectrum;

use super::PartialMap;
use crate::{DensityRule, Irradiance, SurfaceQuery};

/// E = M Σ Pₘ / (π Σ r²ₘ), where part m of M has found K / M photons with the power Pₘ within rₘ
/// (Kato and Saito 2002, "Kilauea: Parallel Global Illumination Renderer", §5.4).
///
/// With equal shares its expectation is K / (K - 1) times the irradiance. With densities λₘ that
/// differ it is about M² / Σ (1 / λₘ), M times their harmonic mean: too low, and no number of
/// photons helps. The rule's kernel plays no part.
pub fn published<P: PartialMap>(
    parts: &[P],
    query: &SurfaceQuery,
    k: NonZeroUsize,
    max_radius: f32,
    rule: &DensityRule,
) -> Irradiance {
    let k_of_part = k.div_ceil(NonZeroUsize::new(parts.len()).unwrap_or(NonZeroUsize::MIN));
    let mut power = Spectrum::BLACK;
    let mut sum_radius_sq = 0.0;
    let mut n_photons = 0;
    for part in parts {
        let near = part.nearest(query, k_of_part, max_radius, rule);
        power += near.iter().map(|photon| photon.power).sum();
        sum_radius_sq += near
            .get(k_of_part.get() - 1)
            .map_or(max_radius * max_radius, |farthest| farthest.d_sq);
        n_photons += near.len() as u32;
    }
    let per_area = if sum_radius_sq > 0.0 {
        parts.len() as f32 / (PI * sum_radius_sq)
    } else {
        0.0
    };
    Irradiance {
        value: power * per_area,
        n_photons,
    }
}
