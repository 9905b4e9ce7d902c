use std::num::NonZeroUsize;

use kilauea_math::{Spectrum, Vec3};
use rayon::prelude::*;

use crate::density::in_curve_order;
use crate::packed::Direction16;
use crate::tree::PointTree;
use crate::{DensityRule, PhotonMap, RadiusRule, SurfaceQuery};

/// Irradiance computed beforehand at a fraction of the photons (Christensen 1999, "Faster Photon Map
/// Global Illumination"): a final gather then looks up one value where it would sum over photons.
///
/// It holds irradiance, not radiance: times albedo / π it is what a diffuse surface sends on.
#[derive(Clone, Debug)]
pub struct RadianceCache {
    tree: PointTree,
    /// By place in the tree.
    records: Vec<Record>,
    min_cos_normals: f32,
}

#[derive(Clone, Copy, Debug)]
struct Record {
    irradiance: [f32; 3],
    n: Direction16,
}

/// Answers to many look-ups.
#[derive(Clone, Debug, PartialEq)]
pub struct RadianceLookups {
    /// Irradiance in W/m², by query; `None` where nothing was near.
    pub irradiances: Vec<Option<Spectrum>>,
    /// Number of queries near which there was nothing.
    pub n_missed: usize,
}

impl RadianceCache {
    /// Irradiance at every `every`-th photon of a map, in the order of the map: so the density of
    /// records follows that of the photons.
    pub fn build(
        map: &PhotonMap,
        every: NonZeroUsize,
        radius: RadiusRule,
        rule: &DensityRule,
    ) -> Self {
        let n_records = map.len().div_ceil(every.get());
        let photon = |i: usize| map.photon(i * every.get());
        let (tree, order) = PointTree::build(n_records, |i| photon(i).p(), |i| i as u64);
        let record = |&i: &u32| {
            let (p, n) = (photon(i as usize).p(), photon(i as usize).n());
            let irradiance = map.irradiance_by(&SurfaceQuery { p, n }, radius, rule);
            Record {
                irradiance: irradiance.value.to_array(),
                n: Direction16::encode(n),
            }
        };
        Self {
            records: order.par_iter().map(record).collect(),
            tree,
            min_cos_normals: rule.min_cos_normals,
        }
    }

    /// Number of places at which irradiance is known.
    pub fn len(&self) -> usize {
        self.records.len()
    }

    /// Whether there is no such place.
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// Memory that the cache takes.
    pub fn bytes(&self) -> usize {
        self.tree.bytes() + size_of_val(self.records.as_slice())
    }

    /// Irradiance in W/m² at the nearest record whose normal agrees with that of the query, if there
    /// is one within `max_distance`.
    #[inline]
    pub fn lookup(&self, query: &SurfaceQuery, max_distance: f32) -> Option<Spectrum> {
        let agrees = |idx: usize| self.n(idx).dot(query.n) >= self.min_cos_normals;
        let found = self
            .tree
            .nearest_one(query.p, max_distance, |idx, _| agrees(idx))?;
        Some(self.records[found.idx as usize].irradiance.into())
    }

    /// [`lookup`](Self::lookup) at many places, by all threads.
    pub fn lookups(&self, queries: &[SurfaceQuery], max_distance: f32) -> RadianceLookups {
        let irradiances = in_curve_order(queries, |query| self.lookup(query, max_distance));
        RadianceLookups {
            n_missed: irradiances.iter().filter(|found| found.is_none()).count(),
            irradiances,
        }
    }

    #[inline]
    fn n(&self, idx: usize) -> Vec3 {
        self.records[idx].n.decode()
    }
}
