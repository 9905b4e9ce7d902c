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
/// The box and edge tests run in `f32` from the origin here; accepted hits are computed in `f64` from
/// the exact `line`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TreeRay<L = Moved> {
    /// Origin, moved along the ray if the line is.
    pub(crate) origin: Vec3A,
    /// Direction, by whose length distances in the tree count.
    pub(crate) dir: Vec3A,
    /// Axis of the largest component of the direction.
    pub(crate) largest_axis: usize,
    /// Least distance in the tree.
    pub(crate) t_min: f32,
    /// Bound on the coordinates by which the rounding of the moved origin, and of distances from
    /// the true one, is judged; zero where the origin was not moved.
    pub(crate) rounded_size: f32,
    /// What the origin and direction are exactly.
    pub(crate) line: L,
}

/// The exact line of a ray and how distances along it become those in a tree.
pub(crate) trait Line: Copy {
    /// A component of the origin; `rounded` is that of the [`TreeRay`].
    fn origin(&self, axis: usize, rounded: f32) -> f64;

    /// A component of the direction; `rounded` is that of the [`TreeRay`].
    fn dir(&self, axis: usize, rounded: f32) -> f64;

    /// A distance of the whole ray in the tree: bounds from below and above.
    fn distance_bounds(&self, t: f32) -> (f32, f32);

    /// The same of a line that may have moved.
    fn moved(&self, origin: Vec3A, dir: Vec3A) -> Moved;
}

/// The line is that of the [`TreeRay`], and distances are those of the ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unmoved;

/// The [`TreeRay`] starts elsewhere on the line, so that an instance far from its viewer still sees
/// coordinates of its own size.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moved {
    /// How far the origin was moved.
    t_start: f64,
    /// Distances in the tree by those of the ray, a power of two: a placement that shrinks its
    /// geometry lengthens the ray's direction, which must fit into `f32`.
    t_scale: f64,
    /// Origin, not moved.
    origin: [f64; 3],
    /// Direction as the ray has it.
    dir: [f64; 3],
}

/// By how much, relative to distances, the box test lets near planes come out too near and far ones
/// too far: three roundings for the test itself (Ize 2013), and three for what the shear of the
/// triangle test may move a corner, so that no box is passed by a line that meets its triangle.
pub(crate) const SLAB_SLACK: f32 = 6.0 * f32::EPSILON;

/// The axes in cyclic order, by the last of them; padded so that no index needs a check.
const AXES: [[usize; 3]; 4] = [[1, 2, 0], [2, 0, 1], [0, 1, 2], [0, 1, 2]];

/// The axis of the largest component, by whether x > y, y > z and z > x (bits 0 to 2).
const LARGEST_AXIS: [u8; 8] = [2, 0, 1, 0, 2, 2, 1, 2];

impl TreeRay<Unmoved> {
    /// A ray in engine space with the origin and direction of `line`.
    #[inline(always)]
    pub(crate) fn world((origin, dir): (Vec3A, Vec3A), t_min: f32) -> Self {
        Self::new(origin, dir, t_min, 0.0, Unmoved)
    }
}

impl TreeRay {
    /// The ray in the space of a placed tree within `ball`, moved to where it enters that.
    #[inline(always)]
    pub(crate) fn transformed(geometry_from_world: &DAffine3, ray: &Ray, ball: &Ball) -> Self {
        let origin = geometry_from_world.transform_point3(ray.origin.as_dvec3());
        let dir = geometry_from_world.transform_vector3(ray.dir.as_dvec3());
        Self::from_start(origin, dir, ray.t_min, ball.entry(origin, dir))
    }

    /// A ray in engine space, moved to where it enters `ball`.
    pub(crate) fn entering(ray: &Ray, ball: &Ball) -> Self {
        let (origin, dir) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
        Self::from_start(origin, dir, ray.t_min, ball.entry(origin, dir))
    }

    /// A ray from `origin` along `dir`, moved by `t_start`. Distances along the whole ray are those
    /// of `f32`, so `t_min` may be a rounding below where it says.
    #[inline(always)]
    fn from_start(origin: DVec3, dir: DVec3, t_min: f32, t_start: f64) -> Self {
        /// Certain hits are told apart, and from `t_min`, by 400 times the rounding of
        /// `rounded_size`: with this part of the way to the tree, by several times that of
        /// distances along the whole ray.
        const OF_THE_WAY: f64 = 1.0 / 64.0;
        let dir_largest = dir.abs().max_element();
        let dir_scale = power_of_two_below_reciprocal(dir_largest);
        // Fused, or the start would be off the line by the rounding of coordinates far away.
        let moved = dir.mul_add(DVec3::splat(t_start), origin).as_vec3a();
        let rounded_size = moved.abs().max_element() + (OF_THE_WAY * t_start * dir_largest) as f32;
        let t_min = (f64::from(t_min) * (1.0 - ULP) - t_start) * ((1.0 - ULP) / dir_scale);
        let line = Moved {
            t_start,
            t_scale: 1.0 / dir_scale,
            origin: origin.to_array(),
            dir: dir.to_array(),
        };
        let scaled_dir = (dir * dir_scale).as_vec3a();
        Self::new(moved, scaled_dir, t_min as f32, rounded_size, line)
    }
}

impl<L: Line> TreeRay<L> {
    #[inline(always)]
    fn new(origin: Vec3A, dir: Vec3A, t_min: f32, rounded_size: f32, line: L) -> Self {
        let size = dir.abs();
        let next = Vec3A::new(size.y, size.z, size.x);
        let greater_than_next = size.cmpgt(next).bitmask() as usize;
        Self {
            origin,
            dir,
            // Without branches: no processor guesses the largest component of scattered directions.
            largest_axis: usize::from(LARGEST_AXIS[greater_than_next & 7]),
            t_min: t_min.max(0.0),
            rounded_size,
            line,
        }
    }

    /// The axes in cyclic order, that of the largest direction component last.
    #[inline(always)]
    pub(crate) fn axes(&self) -> [usize; 3] {
        AXES[self.largest_axis & 3]
    }

    /// A component of the exact origin.
    #[inline(always)]
    pub(crate) fn exact_origin(&self, axis: usize) -> f64 {
        self.line.origin(axis, self.origin[axis])
    }

    /// A component of the exact direction, of which `dir` may be a multiple.
    #[inline(always)]
    pub(crate) fn exact_dir(&self, axis: usize) -> f64 {
        self.line.dir(axis, self.dir[axis])
    }

    /// A distance of the whole ray in the tree: bounds from below and above.
    #[inline(always)]
    pub(crate) fn distance_bounds(&self, t: f32) -> (f32, f32) {
        self.line.distance_bounds(t)
    }

    /// The same ray as one that may have moved.
    #[inline(always)]
    pub(crate) fn moved(&self) -> TreeRay {
        TreeRay {
            origin: self.origin,
            dir: self.dir,
            largest_axis: self.largest_axis,
            t_min: self.t_min,
            rounded_size: self.rounded_size,
            line: self.line.moved(self.origin, self.dir),
        }
    }

    /// Reciprocal of the direction, of no more than 1e18.
    #[inline(always)]
    pub(crate) fn rcp(&self) -> Vec3A {
        let size = self.dir.abs().max(Vec3A::splat(1e-18));
        size.copysign(self.dir).recip()
    }
}

impl Line for Unmoved {
    #[inline(always)]
    fn origin(&self, _: usize, rounded: f32) -> f64 {
        f64::from(rounded)
    }

    #[inline(always)]
    fn dir(&self, _: usize, rounded: f32) -> f64 {
        f64::from(rounded)
    }

    #[inline(always)]
    fn distance_bounds(&self, t: f32) -> (f32, f32) {
        let slack = 2.0 * f32::EPSILON;
        (t * (1.0 - slack), t * (1.0 + slack))
    }

    #[inline(always)]
    fn moved(&self, origin: Vec3A, dir: Vec3A) -> Moved {
        Moved {
            t_start: 0.0,
            t_scale: 1.0,
            origin: origin.as_dvec3().to_array(),
            dir: dir.as_dvec3().to_array(),
        }
    }
}

impl Line for Moved {
    #[inline(always)]
    fn origin(&self, axis: usize, _: f32) -> f64 {
        self.origin[axis]
    }

    #[inline(always)]
    fn dir(&self, axis: usize, _: f32) -> f64 {
        self.dir[axis]
    }

    #[inline(always)]
    fn distance_bounds(&self, t: f32) -> (f32, f32) {
        let t = f64::from(t);
        let (below, above) = (1.0 - ULP, 1.0 + ULP);
        (
            ((t * below - self.t_start) * (below * self.t_scale)) as f32,
            ((t * above - self.t_start) * (above * self.t_scale)) as f32,
        )
    }

    #[inline(always)]
    fn moved(&self, _: Vec3A, _: Vec3A) -> Moved {
        *self
    }
}
