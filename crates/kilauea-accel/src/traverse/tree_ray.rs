use crate::ray::{Ray, power_of_two_below_reciprocal};
use kilauea_math::{Bounds3, DAffine3, DVec3, Vec3A};

/// More than the rounding of a distance to `f32`, relative to it.
const ULP: f64 = f32::EPSILON as f64;

/// A ball around a tree, in the tree's space.
///
/// Rays into placed trees start where they enter it. A box in engine space would not do: it can be
/// larger than the tree by the ratio of the placement's scales, and it is rounded at the distance
/// of the ray's origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ball {
    center: DVec3,
    radius: f64,
}

impl Ball {
    /// Around a box.
    pub(crate) fn around(bounds: &Bounds3) -> Self {
        let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        Self {
            center: 0.5 * (min + max),
            radius: 0.5 * min.distance(max),
        }
    }

    /// Where a ray enters, or a little before: from far away, too, its start must not be rounded
    /// past what touches the ball.
    #[inline(always)]
    fn entry(&self, origin: DVec3, dir: DVec3) -> f64 {
        const BEFORE: f64 = 1.0 - 16.0 * f64::EPSILON;
        let t_middle = (self.center - origin).dot(dir) / dir.length_squared();
        (t_middle * BEFORE - self.radius / dir.abs().max_element()).max(0.0)
    }
}

/// A ray in the space of one tree, with all that the tests derive from it.
///
/// The box and edge tests run in `f32` from an origin moved `t_start` along the ray, so that an
/// instance far from its viewer still sees coordinates of its own size; distances inside the tree
/// count from there. Accepted hits are computed in `f64` from the true origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TreeRay {
    /// Moved origin.
    pub(crate) origin: Vec3A,
    /// Direction, by whose length distances in the tree count.
    pub(crate) dir: Vec3A,
    /// Axis of the largest component of the direction.
    pub(crate) largest_axis: usize,
    /// Least distance in the tree.
    pub(crate) t_min: f32,
    /// How far the origin was moved.
    t_start: f64,
    /// Distances in the tree by those of the ray, a power of two: a placement that shrinks its
    /// geometry lengthens the ray's direction, which must fit into `f32`.
    t_scale: f64,
    /// Bound on the coordinates by which the rounding of the moved origin, and of distances from
    /// the true one, is judged; zero where the origin was not moved.
    pub(crate) rounded_size: f32,
    /// Origin, not moved.
    pub(crate) origin_f64: [f64; 3],
    /// Direction as the ray has it.
    pub(crate) dir_f64: [f64; 3],
}

/// By how much, relative to distances, the box test lets near planes come out too near and far ones
/// too far: three roundings for the test itself (Ize 2013), and three for what the shear of the
/// triangle test may move a corner, so that no box is passed by a line that meets its triangle.
pub(crate) const SLAB_SLACK: f32 = 6.0 * f32::EPSILON;

/// The axes in cyclic order, by the last of them; padded so that no index needs a check.
const AXES: [[usize; 3]; 4] = [[1, 2, 0], [2, 0, 1], [0, 1, 2], [0, 1, 2]];

impl TreeRay {
    /// A ray in engine space, with the origin and direction of `line`.
    #[inline(always)]
    pub(crate) fn world((origin, dir): (Vec3A, Vec3A), t_min: f32) -> Self {
        let ends = (origin.as_dvec3(), dir.as_dvec3());
        Self::with_rounded(origin, dir, ends, t_min, 0.0)
    }

    /// The ray in the space of a placed tree within `ball`, moved to where it enters that.
    #[inline(always)]
    pub(crate) fn transformed(geometry_from_world: &DAffine3, ray: &Ray, ball: &Ball) -> Self {
        let origin = geometry_from_world.transform_point3(ray.origin.as_dvec3());
        let dir = geometry_from_world.transform_vector3(ray.dir.as_dvec3());
        Self::moved(origin, dir, ray.t_min, ball.entry(origin, dir))
    }

    /// A ray in engine space, moved to where it enters `ball`.
    pub(crate) fn entering(ray: &Ray, ball: &Ball) -> Self {
        let (origin, dir) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
        Self::moved(origin, dir, ray.t_min, ball.entry(origin, dir))
    }

    /// A ray from `origin` along `dir`, moved by `t_start`. Distances along the whole ray are those
    /// of `f32`, so `t_min` may be a rounding below where it says.
    #[inline(always)]
    fn moved(origin: DVec3, dir: DVec3, t_min: f32, t_start: f64) -> Self {
        /// Certain hits are told apart, and from `t_min`, by 400 times the rounding of
        /// `rounded_size`: with this part of the way to the tree, by several times that of
        /// distances along the whole ray.
        const OF_THE_WAY: f64 = 1.0 / 64.0;
        let dir_largest = dir.abs().max_element();
        let dir_scale = power_of_two_below_reciprocal(dir_largest);
        let moved = (origin + dir * t_start).as_vec3a();
        let rounded_size = moved.abs().max_element() + (OF_THE_WAY * t_start * dir_largest) as f32;
        let t_min = (f64::from(t_min) * (1.0 - ULP) - t_start) * ((1.0 - ULP) / dir_scale);
        let scaled_dir = (dir * dir_scale).as_vec3a();
        let ends = (origin, dir);
        Self {
            t_start,
            t_scale: 1.0 / dir_scale,
            ..Self::with_rounded(moved, scaled_dir, ends, t_min as f32, rounded_size)
        }
    }

    #[inline(always)]
    fn with_rounded(
        moved: Vec3A,
        scaled_dir: Vec3A,
        (origin, dir): (DVec3, DVec3),
        t_min: f32,
        rounded_size: f32,
    ) -> Self {
        let size = scaled_dir.abs();
        // Without branches: no processor guesses the largest component of scattered directions.
        let is_x = usize::from(size.x > size.y) & usize::from(size.x > size.z);
        let is_y = (1 - is_x) & usize::from(size.y > size.z);
        Self {
            origin: moved,
            dir: scaled_dir,
            largest_axis: 2 - 2 * is_x - is_y,
            t_min: t_min.max(0.0),
            t_start: 0.0,
            t_scale: 1.0,
            rounded_size,
            origin_f64: origin.to_array(),
            dir_f64: dir.to_array(),
        }
    }

    /// Reciprocal of the direction, of no more than 1e18.
    #[inline(always)]
    pub(crate) fn rcp(&self) -> Vec3A {
        let size = self.dir.abs().max(Vec3A::splat(1e-18));
        size.copysign(self.dir).recip()
    }

    /// The axes in cyclic order, that of the largest direction component last.
    #[inline(always)]
    pub(crate) fn axes(&self) -> [usize; 3] {
        AXES[self.largest_axis & 3]
    }

    /// A distance of the whole ray in the tree: bounds from below and above.
    #[inline(always)]
    pub(crate) fn distance_bounds(&self, t: f32) -> (f32, f32) {
        let t = f64::from(t);
        let (below, above) = (1.0 - ULP, 1.0 + ULP);
        (
            ((t * below - self.t_start) * (below * self.t_scale)) as f32,
            ((t * above - self.t_start) * (above * self.t_scale)) as f32,
        )
    }
}
