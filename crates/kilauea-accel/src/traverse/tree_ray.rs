use crate::ray::Ray;
use kilauea_math::{DAffine3, DVec3, Vec3};

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
    pub(crate) t_start: f32,
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
        Self::with_rounded(ray.origin, ray.dir, ends, ray.t_min, 0.0, 0.0)
    }

    /// A ray from `origin` along `dir` from `t_min` on, moved by `t_start <= t_min`.
    #[inline(always)]
    fn moved(origin: DVec3, dir: DVec3, t_min: f32, t_start: f32) -> Self {
        let moved = (origin + dir * f64::from(t_start)).as_vec3();
        let t_min = (t_min - t_start) * (1.0 - f32::EPSILON);
        let size = moved.abs().max_element();
        Self::with_rounded(moved, dir.as_vec3(), (origin, dir), t_min, t_start, size)
    }

    /// The ray in the space of an instance whose box it enters at `t_entry`, moved to there.
    #[inline(always)]
    pub(crate) fn transformed(geometry_from_world: &DAffine3, ray: &Ray, t_entry: f32) -> Self {
        let t_start = t_entry * (1.0 - 1.0 / (1 << 20) as f32);
        Self::moved(
            geometry_from_world.transform_point3(ray.origin.as_dvec3()),
            geometry_from_world.transform_vector3(ray.dir.as_dvec3()),
            t_start.max(ray.t_min),
            t_start,
        )
    }

    #[inline(always)]
    fn with_rounded(
        moved: Vec3,
        d: Vec3,
        (origin, dir): (DVec3, DVec3),
        t_min: f32,
        t_start: f32,
        rounded_size: f32,
    ) -> Self {
        /// Three for the box test itself (Ize 2013), and three for what the shear of the triangle
        /// test may move a corner, so that no box is passed by a line that meets its triangle.
        const SLACK: f32 = 6.0 * f32::EPSILON;
        let size = d.abs();
        // Without branches: no processor guesses the largest component of scattered directions.
        let is_x = usize::from(size.x > size.y) & usize::from(size.x > size.z);
        let is_y = (1 - is_x) & usize::from(size.y > size.z);
        let kz = 2 - 2 * is_x - is_y;
        let axes = [[1, 2, 0][kz], [2, 0, 1][kz], kz];
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
            t_start,
            rounded_size,
            origin_f64: origin.to_array(),
            dir_f64: dir.to_array(),
        }
    }

    /// A distance of the whole ray in the tree: bounds from below and above.
    #[inline(always)]
    pub(crate) fn distance_bounds(&self, t: f32) -> (f32, f32) {
        const SLACK: f32 = 2.0 * f32::EPSILON;
        (
            t * (1.0 - SLACK) - self.t_start,
            t * (1.0 + SLACK) - self.t_start,
        )
    }

    /// A point in the plane across the ray, in the arithmetic that all kernels share.
    #[inline(always)]
    pub(crate) fn sheared(&self, p: [f32; 3]) -> [f32; 2] {
        let [kx, ky, kz] = self.axes;
        let along = p[kz] - self.origin[kz];
        [
            (p[kx] - self.origin[kx]) - self.shear[0] * along,
            (p[ky] - self.origin[ky]) - self.shear[1] * along,
        ]
    }
}
