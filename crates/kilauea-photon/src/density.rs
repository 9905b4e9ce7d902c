use kilauea_math::{Bounds3, Spectrum, Vec3};
use rayon::prelude::*;

use crate::tree::MortonGrid;
use crate::{Kernel, PhotonMap, StoredPhoton};

/// Queries that one thread takes at a time.
const QUERIES_PER_TASK: usize = 256;

/// A place on a surface where the density of photons is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceQuery {
    /// The place.
    pub p: Vec3,
    /// Unit geometric normal, on the side that is asked for.
    pub n: Vec3,
}

/// Which photons within the radius belong to the surface at the centre, and how they count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DensityRule {
    /// By distance.
    pub kernel: Kernel,
    /// Lowest cosine between the normals of photon and query.
    pub min_cos_normals: f32,
    /// Greatest distance of a photon from the query's tangent plane, in radii: keeps photons of
    /// neighbouring surfaces out where the normals agree.
    pub max_plane_distance: f32,
}

impl Default for DensityRule {
    /// Epanechnikov's kernel, normals within 60 degrees, planes within 0.3 radii.
    fn default() -> Self {
        Self {
            kernel: Kernel::Epanechnikov,
            min_cos_normals: 0.5,
            max_plane_distance: 0.3,
        }
    }
}

impl DensityRule {
    /// Whether a photon lies on the surface of the query.
    #[inline]
    pub fn accepts(&self, query: &SurfaceQuery, photon: StoredPhoton<'_>, radius: f32) -> bool {
        let plane_distance = (photon.p() - query.p).dot(query.n).abs();
        plane_distance <= self.max_plane_distance * radius
            && photon.n().dot(query.n) >= self.min_cos_normals
    }
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
    /// Irradiance at a place, E = Σ Φᵢ K(dᵢ): the flux of the photons that the rule accepts, by
    /// area (Jensen 1996, with a fixed radius as in Hachisuka et al. 2008).
    pub fn irradiance(&self, query: &SurfaceQuery, radius: f32, rule: &DensityRule) -> Irradiance {
        let radius_sq = radius * radius;
        let mut found = Irradiance::default();
        self.for_each_within(query.p, radius, |photon, d_sq| {
            if rule.accepts(query, photon, radius) {
                found.value += photon.power() * rule.kernel.weight(d_sq, radius_sq);
                found.n_photons += 1;
            }
        });
        found
    }

    /// [`irradiance`](Self::irradiance) at many places, by all threads, in the order of the
    /// queries. They are worked off in Morton order, so that neighbours find the tree in the cache.
    pub fn irradiances(
        &self,
        queries: &[SurfaceQuery],
        radius: f32,
        rule: &DensityRule,
    ) -> Vec<Irradiance> {
        let mut found: Vec<(u32, Irradiance)> = curve_order(queries)
            .into_par_iter()
            .with_min_len(QUERIES_PER_TASK)
            .map(|i| (i, self.irradiance(&queries[i as usize], radius, rule)))
            .collect();
        found.par_sort_unstable_by_key(|&(i, _)| i);
        found
            .into_iter()
            .map(|(_, irradiance)| irradiance)
            .collect()
    }
}

/// Numbers of the queries along Morton's curve.
fn curve_order(queries: &[SurfaceQuery]) -> Vec<u32> {
    let grid = MortonGrid::around(&Bounds3::from_points(queries.iter().map(|q| q.p)));
    let mut order: Vec<u32> = (0..queries.len() as u32).collect();
    order.par_sort_by_cached_key(|&i| grid.code(queries[i as usize].p));
    order
}
