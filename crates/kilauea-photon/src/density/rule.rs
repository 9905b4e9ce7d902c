use std::num::NonZeroUsize;

use kilauea_math::Vec3;

use super::{Kernel, SurfaceQuery};
use crate::StoredPhoton;

/// How large a disc is in which photons are counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RadiusRule {
    /// The same everywhere, in metres.
    Fixed(f32),
    /// As far as the `k`-th nearest photon, but no farther than `max_radius`.
    Nearest {
        /// Number of photons.
        k: NonZeroUsize,
        /// In metres.
        max_radius: f32,
    },
}

/// Which photons around a place belong to its surface, and how they count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DensityRule {
    /// By distance.
    pub kernel: Kernel,
    /// Lowest cosine between the normals of photon and query.
    pub min_cos_normals: f32,
    /// Greatest distance of a photon from the query's tangent plane, over its distance from the
    /// query: keeps out photons of neighbouring surfaces whose normals agree.
    pub max_plane_distance: f32,
}

impl Default for DensityRule {
    /// Epanechnikov's kernel, normals within 60 degrees, and 0.3 for the distance from the plane.
    fn default() -> Self {
        Self {
            kernel: Kernel::Epanechnikov,
            min_cos_normals: 0.5,
            max_plane_distance: 0.3,
        }
    }
}

impl DensityRule {
    /// Whether a photon at the squared distance `d_sq` lies on the surface of the query.
    #[inline]
    pub fn accepts(&self, query: &SurfaceQuery, photon: StoredPhoton<'_>, d_sq: f32) -> bool {
        self.is_near_plane(query, photon.p(), d_sq) && self.agrees(query, photon.n())
    }

    /// Whether a place `p` with the normal `n` at the squared distance `d_sq` lies on the surface of the
    /// query.
    #[inline]
    pub(crate) fn accepts_at(&self, query: &SurfaceQuery, (p, n): (Vec3, Vec3), d_sq: f32) -> bool {
        self.is_near_plane(query, p, d_sq) && self.agrees(query, n)
    }

    #[inline]
    fn is_near_plane(&self, query: &SurfaceQuery, p: Vec3, d_sq: f32) -> bool {
        let plane_distance = (p - query.p).dot(query.n);
        plane_distance * plane_distance <= self.max_plane_distance * self.max_plane_distance * d_sq
    }

    #[inline]
    fn agrees(&self, query: &SurfaceQuery, n: Vec3) -> bool {
        n.dot(query.n) >= self.min_cos_normals
    }
}
