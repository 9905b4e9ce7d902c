use std::num::NonZeroUsize;

use kilauea_math::{Spectrum, Vec3};
use rayon::prelude::*;

use crate::packed::{LightTable, PackedPhoton, PowerScale};
use crate::photon::{Photon, PhotonClass};
use crate::tree::{Found, PointTree};

/// Photons and a tree to find them by place.
///
/// The same photons give the same map, in whatever order they come and with any number of threads.
#[derive(Clone, Debug)]
pub struct PhotonMap {
    tree: PointTree,
    /// By place in the tree, like `d_eye`.
    photons: Vec<PackedPhoton>,
    /// Empty in maps without caustic photons.
    d_eye: Vec<f32>,
    /// Greatest channel of a power.
    brightest: f32,
    power_scale: PowerScale,
    lights: LightTable,
    n_rejected: usize,
}

impl PhotonMap {
    /// A map of all valid photons. The others are counted.
    ///
    /// # Panics
    ///
    /// If there are 2³² photons or more.
    pub fn build(photons: &[Photon]) -> Self {
        Self::build_part(photons, 0.0)
    }

    /// A part of a map in which no channel of a valid photon's power is above `brightest`: its photons
    /// are, bit for bit, as they are in the whole, but for the numbers of their lights.
    ///
    /// # Panics
    ///
    /// If there are 2³² photons or more.
    pub fn build_part(photons: &[Photon], brightest: f32) -> Self {
        let valid: Vec<&Photon> = photons.par_iter().filter(|p| p.is_valid()).collect();
        let (tree, order) = PointTree::build(valid.len(), |i| valid[i].p, |i| valid[i].key());
        let ordered = || order.par_iter().map(|&i| valid[i as usize]);

        let max_channel = valid.par_iter().map(|photon| photon.power.max_channel());
        let brightest = max_channel.reduce(|| brightest, f32::max);
        let power_scale = PowerScale::up_to(brightest);
        let lights = LightTable::new(valid.iter().map(|photon| photon.light_idx));
        let has_caustic = valid
            .par_iter()
            .any(|photon| photon.class != PhotonClass::Global);
        let packed = ordered().map(|photon| PackedPhoton::new(photon, &power_scale, &lights));
        Self {
            photons: packed.collect(),
            d_eye: if has_caustic {
                ordered().map(Photon::d_eye).collect()
            } else {
                Vec::new()
            },
            tree,
            brightest,
            power_scale,
            lights,
            n_rejected: photons.len() - valid.len(),
        }
    }

    /// Number of photons.
    pub fn len(&self) -> usize {
        self.photons.len()
    }

    /// Whether there is no photon.
    pub fn is_empty(&self) -> bool {
        self.photons.is_empty()
    }

    /// How many photons were left out since something of them was not finite, negative, or not of
    /// length one.
    pub fn n_rejected(&self) -> usize {
        self.n_rejected
    }

    /// The greatest channel of a photon's power, in the whole if this is a part.
    pub fn brightest(&self) -> f32 {
        self.brightest
    }

    /// Memory that the map takes.
    pub fn bytes(&self) -> usize {
        self.tree.bytes()
            + size_of_val(self.photons.as_slice())
            + size_of_val(self.d_eye.as_slice())
            + self.lights.bytes()
    }

    /// Photon number `idx` of `0..len()`, where near numbers mostly lie near each other.
    #[inline]
    pub fn photon(&self, idx: usize) -> StoredPhoton<'_> {
        StoredPhoton { map: self, idx }
    }

    /// Calls `visit(photon, squared distance)` for all photons at most `radius` from `p`, always in
    /// the same order.
    #[inline]
    pub fn for_each_within(
        &self,
        p: Vec3,
        radius: f32,
        mut visit: impl FnMut(StoredPhoton<'_>, f32),
    ) {
        self.tree
            .for_each_within(p, radius, |idx, d_sq| visit(self.photon(idx), d_sq));
    }

    /// The `k` photons nearest to `p` and at most `max_radius` from it, nearest first; fewer if
    /// there are no more.
    pub fn nearest(&self, p: Vec3, k: NonZeroUsize, max_radius: f32) -> Vec<Found> {
        self.nearest_where(p, k, max_radius, |_, _| true)
    }

    /// As [`nearest`](Self::nearest), of the photons for which `accept(photon, squared distance)` holds.
    pub fn nearest_where(
        &self,
        p: Vec3,
        k: NonZeroUsize,
        max_radius: f32,
        accept: impl Fn(StoredPhoton<'_>, f32) -> bool,
    ) -> Vec<Found> {
        self.tree.nearest(p, k.get(), max_radius, |idx, d_sq| {
            accept(self.photon(idx), d_sq)
        })
    }
}

/// A photon of a map, unpacked piece by piece.
#[derive(Clone, Copy, Debug)]
pub struct StoredPhoton<'m> {
    map: &'m PhotonMap,
    idx: usize,
}

impl StoredPhoton<'_> {
    /// Its number in the map.
    #[inline]
    pub fn idx(self) -> usize {
        self.idx
    }

    /// Where it arrived; exact.
    #[inline]
    pub fn p(self) -> Vec3 {
        self.map.tree.point(self.idx)
    }

    /// Flux in W. Each channel is off by at most 1/255 of the largest one (or 2⁻³⁹ of the largest in
    /// the map), and right in expectation.
    #[inline]
    pub fn power(self) -> Spectrum {
        self.map.power_scale.decode(self.packed().power)
    }

    /// Unit direction to where it came from, to 0.0037 degrees.
    #[inline]
    pub fn wi(self) -> Vec3 {
        self.packed().wi.decode()
    }

    /// Unit geometric normal, to 0.95 degrees.
    #[inline]
    pub fn n(self) -> Vec3 {
        self.packed().n.decode()
    }

    /// Which light it is from; `None` if its map has photons of more than 32,767 lights and this is
    /// from none of the first.
    #[inline]
    pub fn light_idx(self) -> Option<u32> {
        self.map.lights.light_idx(self.packed().light_number())
    }

    /// What its path was like; exact.
    #[inline]
    pub fn class(self) -> PhotonClass {
        if self.packed().is_caustic() {
            PhotonClass::Caustic {
                d_eye: self.map.d_eye[self.idx],
            }
        } else {
            PhotonClass::Global
        }
    }

    #[inline]
    fn packed(self) -> PackedPhoton {
        self.map.photons[self.idx]
    }
}
