use kilauea_math::{Spectrum, Vec3};

use crate::density::{DensityRule, RadiusRule, SurfaceQuery};
use crate::{PhotonMap, StoredPhoton};

/// The photons around a record, and how far they are.
///
/// Those at which there are records do not count. With its own photon a record would say more than is
/// true; and a record that happens to be far from others stands for more of the surface, so that where
/// photons are by chance sparse they would count for more than where they are dense. So records lie
/// where they would lie by chance, and the other photons are as dense there as anywhere.
pub(super) struct Disc {
    /// From the middle, with the flux in W.
    photons: Vec<(Vec3, Spectrum)>,
    radius: f32,
}

/// Fewer photons do not tell whether they are spread evenly.
const MIN_TO_TELL: usize = 16;
/// Greatest difference between the share of photons in the inner half of the disc's area and a half.
const MAX_INNER_EXCESS: f32 = 0.2;

impl Disc {
    /// Of the photon with that number in the map, where every `every`-th has a record. If all have, all
    /// but itself count.
    pub(super) fn around(
        map: &PhotonMap,
        idx: usize,
        every: usize,
        radius: RadiusRule,
        rule: &DensityRule,
    ) -> Self {
        let photon = map.photon(idx);
        let query = SurfaceQuery {
            p: photon.p(),
            n: photon.n(),
        };
        let has_record = |other: usize| {
            if every > 1 {
                other.is_multiple_of(every)
            } else {
                other == idx
            }
        };
        // What those that do not count would have brought.
        let share = if every > 1 {
            every as f32 / (every - 1) as f32
        } else {
            1.0
        };
        let is_other = |other: StoredPhoton<'_>, d_sq| {
            !has_record(other.idx()) && rule.accepts(&query, other, d_sq)
        };
        let relative = |other: StoredPhoton<'_>| (other.p() - query.p, other.power() * share);
        match radius {
            RadiusRule::Fixed(radius) => {
                let mut photons = Vec::new();
                map.for_each_within(query.p, radius, |other, d_sq| {
                    if is_other(other, d_sq) {
                        photons.push(relative(other));
                    }
                });
                Self { photons, radius }
            }
            RadiusRule::Nearest { k, max_radius } => {
                let mut found = map.nearest_where(query.p, k, max_radius, is_other);
                // The farthest only says how far the others are.
                let radius = if found.len() == k.get() {
                    found.pop().map_or(0.0, |farthest| farthest.d_sq.sqrt())
                } else {
                    max_radius
                };
                let photons = found.iter().map(|f| relative(map.photon(f.idx as usize)));
                Self {
                    photons: photons.collect(),
                    radius,
                }
            }
        }
    }

    pub(super) fn radius(&self) -> f32 {
        self.radius
    }

    /// In W/m².
    pub(super) fn irradiance(&self, rule: &DensityRule) -> Spectrum {
        let radius_sq = self.radius * self.radius;
        let weighted = |(d, power): &(Vec3, Spectrum)| {
            *power * rule.kernel.weight(d.length_squared(), radius_sq)
        };
        self.photons.iter().map(weighted).sum()
    }

    /// Whether photons are as dense in the middle of the disc as farther out.
    ///
    /// In the dark beside a bright spot they are not: the spot's photons say how large the disc is, and
    /// an estimate by nearest photons, which falls with the square of the distance only, has more light
    /// in all than there is.
    pub(super) fn is_even(&self) -> bool {
        if self.photons.len() < MIN_TO_TELL {
            return true;
        }
        let n = self.photons.len() as f32;
        let half_sq = 0.5 * self.radius * self.radius;
        let is_inner = |(d, _): &&(Vec3, Spectrum)| d.length_squared() < half_sq;
        let inner_share = self.photons.iter().filter(is_inner).count() as f32 / n;
        (inner_share - 0.5).abs() <= MAX_INNER_EXCESS
    }
}
