use crate::ray::{Ray, power_of_two_below_reciprocal};
use kilauea_math::{DVec3, Vec3};

/// More than the rounding of a distance to `f32`, relative to it.
const ULP: f64 = f32::EPSILON as f64;

/// A ray in the space of one tree, with all that the tests derive from it.
///
/// The box and edge tests run in `f32` from an origin moved `t_start` along the ray, so that an
/// instance far from its viewer still sees coordinates of its own size; distances inside the tree
/// count from there. Accepted hits are computed in `f64` from the true origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TreeRay {
    /// Moved origin.
    pub(crate) origin: [f32; 3],
    /// Reciprocal direction a little too small: distances to near planes come out too near.
    pub(crate) near_rcp: [f32; 3],
    /// Reciprocal direction a little too large.
    pub(crate) far_rcp: [f32; 3],
    /// Row of `Node8::planes` that the ray meets first, by axis; the last is this with bit 0
    /// flipped.
    pub(crate) near_plane: [usize; 3],
    /// The axes in cyclic order, that of the largest direction component last.
    pub(crate) axes: [usize; 3],
    /// Shear that takes the direction to the last axis (Woop et al. 2013).
    pub(crate) shear: [f32; 2],
    /// Least distance in the tree.
    pub(crate) t_min: f32,
    /// How far the origin was moved.
    pub(crate) t_start: f64,
    /// Distances in the tree by those of the ray: a placement that shrinks its geometry lengthens
    /// the ray's direction, which must fit into `f32`.
    pub(crate) t_scale: f64,
    /// Bound on the coordinates by which the rounding of the moved origin is judged; zero where
    /// the origin was not rounded.
    pub(crate) rounded_size: f32,
    /// Origin, not moved.
    pub(crate) origin_f64: [f64; 3],
    /// Direction.
    pub(crate) dir_f64: [f64; 3],
}

impl TreeRay {
    /// A ray in engine space.
    #[inline(always)]
    pub(crate) fn world(ray: &Ray) -> Self {
        let ends = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
        Self::with_rounded(ray.origin, ray.dir, ends, ray.t_min, 0.0)
    }

    /// A ray from `origin` along `dir`, moved by `t_start`. Distances along the whole ray are those
    /// of `f32`, so `t_min` may be a rounding below where it says.
    #[inline(always)]
    pub(crate) fn moved(origin: DVec3, dir: DVec3, t_min: f32, t_start: f64) -> Self {
        let moved = (origin + dir * t_start).as_vec3();
        let dir_scale = power_of_two_below_reciprocal(dir.abs().max_element());
        let t_min = (f64::from(t_min) * (1.0 - ULP) - t_start) * ((1.0 - ULP) / dir_scale);
        let size = moved.abs().max_element();
        let ends = (origin, dir);
        let mut ray =
            Self::with_rounded(moved, (dir * dir_scale).as_vec3(), ends, t_min as f32, size);
        ray.t_start = t_start;
        ray.t_scale = 1.0 / dir_scale;
        ray
    }

    #[inline(always)]
    fn with_rounded(
        moved: Vec3,
        d: Vec3,
        (origin, dir): (DVec3, DVec3),
        t_min: f32,
        rounded_size: f32,
    ) -> Self {
        // Three for the box test itself (Ize 2013), and three for what the shear of the triangle
        // test may move a corner, so that no box is passed by a line that meets its triangle.
        const SLACK: f32 = 6.0 * f32::EPSILON;
        let size = d.abs();
        let axes = if size.x > size.y && size.x > size.z {
            [1, 2, 0]
        } else if size.y > size.z {
            [2, 0, 1]
        } else {
            [0, 1, 2]
        };
        let d_array = d.to_array();
        let rcp_largest = 1.0 / d_array[axes[2]];
        let rcp = size.max(Vec3::splat(1e-18)).copysign(d).recip();
        Self {
            origin: moved.to_array(),
            near_rcp: (rcp * (1.0 - SLACK)).to_array(),
            far_rcp: (rcp * (1.0 + SLACK)).to_array(),
            near_plane: [
                usize::from(d.x.is_sign_negative()),
                2 + usize::from(d.y.is_sign_negative()),
                4 + usize::from(d.z.is_sign_negative()),
            ],
            axes,
            shear: [
                d_array[axes[0]] * rcp_largest,
                d_array[axes[1]] * rcp_largest,
            ],
            t_min: t_min.max(0.0),
            t_start: 0.0,
            t_scale: 1.0,
            rounded_size,
            origin_f64: origin.to_array(),
            dir_f64: dir.to_array(),
        }
    }

    /// A distance of the whole ray, as a bound for distances in the tree.
    #[inline(always)]
    pub(crate) fn limit(&self, t: f32) -> f32 {
        ((f64::from(t) * (1.0 + ULP) - self.t_start) * ((1.0 + ULP) * self.t_scale)) as f32
    }
}
