mod disc;

use std::num::NonZeroUsize;

use kilauea_math::{Spectrum, Vec3};
use rayon::prelude::*;

use crate::density::in_curve_order;
use crate::packed::Direction16;
use crate::tree::PointTree;
use crate::{DensityRule, PhotonMap, RadiusRule, SurfaceQuery};
use disc::Disc;

/// Irradiance computed beforehand at a fraction of the photons (Christensen 1999, "Faster Photon Map
/// Global Illumination"): a final gather then looks up one value where it would sum over photons.
///
/// It holds irradiance, not radiance: times albedo / π it is what a diffuse surface sends on.
#[derive(Clone, Debug)]
pub struct RadianceCache {
    tree: PointTree,
    /// By place in the tree.
    records: Vec<Record>,
    rule: DensityRule,
}

#[derive(Clone, Copy, Debug)]
struct Record {
    irradiance: [f32; 3],
    /// Zero where photons are too uneven to say what irradiance is.
    radius: f32,
    n: Direction16,
}

/// What a record says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CachedIrradiance {
    /// In W/m².
    pub value: Spectrum,
    /// How far the photons are that it is from: what is finer than that is blurred.
    pub radius: f32,
}

/// Answers to many look-ups.
#[derive(Clone, Debug, PartialEq)]
pub struct RadianceLookups {
    /// By query; `None` where nothing was near.
    pub irradiances: Vec<Option<CachedIrradiance>>,
    /// Number of queries near which there was nothing.
    pub n_missed: usize,
}

impl RadianceCache {
    /// Irradiance at every `every`-th photon of a map, from those between, in the order of the map: so
    /// the density of records follows that of the photons.
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
            let photon = photon(i as usize);
            let disc = Disc::around(map, photon.idx(), every.get(), radius, rule);
            Record {
                irradiance: disc.irradiance(rule).to_array(),
                radius: if disc.is_even() { disc.radius() } else { 0.0 },
                n: Direction16::encode(photon.n()),
            }
        };
        Self {
            records: order.par_iter().map(record).collect(),
            tree,
            rule: *rule,
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

    /// Irradiance at the nearest record on the surface of the query, if there is one within
    /// `max_distance` that is from photons so far away, and these are spread evenly.
    #[inline]
    pub fn lookup(&self, query: &SurfaceQuery, max_distance: f32) -> Option<CachedIrradiance> {
        let found = self.tree.nearest_one(query.p, max_distance, |idx, d_sq| {
            let p = self.tree.point(idx);
            self.rule.accepts_at(query, (p, self.n(idx)), d_sq)
        })?;
        let record = &self.records[found.idx as usize];
        let knows = record.radius > 0.0 && found.d_sq <= record.radius * record.radius;
        knows.then(|| CachedIrradiance {
            value: record.irradiance.into(),
            radius: record.radius,
        })
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
