use crate::visibility::Visibility;
use kilauea_math::{Vec3, Vec3A};

/// A half-open segment of a line: the points `origin + t * dir` with `t_min < t <= t_max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start of the line, engine space; from beyond 1e32, hits may be missed.
    pub origin: Vec3,
    /// Direction of any length but zero; `t` counts in this length.
    pub dir: Vec3,
    /// Exclusive lower end; negative counts as zero.
    pub t_min: f32,
    /// Inclusive upper end; may be infinite.
    pub t_max: f32,
    /// When, in [0, 1] over the shutter.
    pub time: f32,
    /// Of which kinds it is.
    pub visibility: Visibility,
    /// The triangle that it starts on, or none. What is flat is not met again, and a ray that says
    /// where it comes from spares the tracer finding that out in `f64`.
    pub from: PrimitiveId,
}

/// A primitive as hits name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrimitiveId {
    /// Index of the placement.
    pub instance: u32,
    /// Primitive within its geometry.
    pub primitive: u32,
}

impl PrimitiveId {
    /// No primitive.
    pub const NONE: Self = Self {
        instance: u32::MAX,
        primitive: u32::MAX,
    };
}

impl Ray {
    /// The whole half line from `origin`, as the shutter opens, that meets everything.
    #[inline]
    pub fn new(origin: Vec3, dir: Vec3) -> Self {
        Self {
            origin,
            dir,
            t_min: 0.0,
            t_max: f32::INFINITY,
            time: 0.0,
            visibility: Visibility::ALL,
            from: PrimitiveId::NONE,
        }
    }

    /// The point at `t`.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.dir
    }

    /// Whether the ray can hit anything: no NaN, finite ends of the line, a direction, a range.
    #[inline]
    pub fn is_valid(&self) -> bool {
        self.origin.is_finite()
            && self.dir.is_finite()
            && self.dir != Vec3::ZERO
            && self.t_min.max(0.0) < self.t_max
            && !self.t_min.is_nan()
            && !self.time.is_nan()
    }

    /// Origin and direction as vectors.
    #[inline(always)]
    pub(crate) fn line(&self) -> (Vec3A, Vec3A) {
        (gather(&self.origin), gather(&self.dir))
    }

    /// Whether the ray is valid, its origin not too far away for products with reciprocals in `f32`,
    /// and its direction neither too long nor too short for reciprocals and shears.
    #[inline(always)]
    pub(crate) fn is_moderate(&self) -> bool {
        const MAX_ORIGIN: f32 = 1e19;
        const MAX_DIR: f32 = 1e9;
        let (origin, dir) = self.line();
        let dir_size = dir.abs();
        // What is not a number compares as false.
        let is_small =
            origin.abs().cmplt(Vec3A::splat(MAX_ORIGIN)) & dir_size.cmplt(Vec3A::splat(MAX_DIR));
        is_small.all()
            && dir_size.cmpge(Vec3A::splat(1.0 / MAX_DIR)).any()
            && self.t_min < self.t_max
            && 0.0 < self.t_max
            && !self.time.is_nan()
    }

    /// The same ray with a direction whose largest component is about one, and the factor that
    /// takes its distances to those of `self`: a power of two, so that the line stays the same.
    pub(crate) fn with_moderate_dir(&self) -> (Self, f64) {
        let factor = power_of_two_below_reciprocal(self.dir.abs().max_element().into());
        let scaled = Self {
            origin: self.origin,
            dir: (self.dir.as_dvec3() * factor).as_vec3(),
            t_min: (f64::from(self.t_min) / factor) as f32,
            t_max: (f64::from(self.t_max) / factor) as f32,
            ..*self
        };
        (scaled, factor)
    }
}

/// Where a ray meets a primitive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// Barycentric weight of a triangle's second vertex; along a curve's segment, in [0, 1]; zero
    /// on spheres.
    pub u: f32,
    /// Barycentric weight of a triangle's third vertex; across a ribbon, in [0, 1], with 0.5 on its
    /// axis; zero on spheres and round curves.
    pub v: f32,
    /// Primitive within its geometry, counted as in [`crate::Geometry`].
    pub primitive: u32,
    /// Index of the placement.
    pub instance: u32,
}

impl Hit {
    /// What is hit.
    #[inline(always)]
    pub fn id(&self) -> PrimitiveId {
        PrimitiveId {
            instance: self.instance,
            primitive: self.primitive,
        }
    }

    /// The order in which hits win: nearest, then lowest instance, then lowest primitive.
    #[inline(always)]
    pub fn wins_over(&self, other: &Self) -> bool {
        self.t < other.t
            || (self.t == other.t
                && (self.instance, self.primitive) < (other.instance, other.primitive))
    }
}

/// The power of two that takes a positive number to between one and two; of no number, anything.
#[inline(always)]
pub(crate) fn power_of_two_below_reciprocal(x: f64) -> f64 {
    const BIAS: u64 = 1023;
    let biased_exponent = (x.to_bits() >> 52).clamp(1, 2 * BIAS - 1);
    f64::from_bits((2 * BIAS - biased_exponent) << 52)
}

/// Reads a vector component by component. A ray has mostly just been written, in parts; a load of
/// sixteen bytes, as compilers like to make of it, would have to wait until all of that and all that
/// came before has left the processor's store buffer, and so no ray would begin before the one
/// before it had ended.
#[inline(always)]
#[allow(unsafe_code, reason = "no safe load is left as it is")]
fn gather(v: &Vec3) -> Vec3A {
    // SAFETY: the components are read through references to them.
    let read = |component: &f32| unsafe { std::ptr::read_volatile(component) };
    Vec3A::new(read(&v.x), read(&v.y), read(&v.z))
}
