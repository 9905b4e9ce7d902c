use kilauea_math::Vec3;

/// A ray as it lies in memory before any tracer sees it: the points `origin + t * dir` with
/// `t_min < t <= t_max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Start of the line.
    pub origin: [f32; 3],
    /// Not negative.
    pub t_min: f32,
    /// Direction of any length but zero; `t` counts in this length.
    pub dir: [f32; 3],
    /// May be infinite.
    pub t_max: f32,
}

impl Segment {
    /// The whole half line from `origin`.
    pub fn new(origin: Vec3, dir: Vec3) -> Self {
        Self::until(origin, dir, f32::INFINITY)
    }

    /// The line from `origin` to `origin + t_max * dir`.
    pub fn until(origin: Vec3, dir: Vec3, t_max: f32) -> Self {
        Self {
            origin: origin.to_array(),
            t_min: 0.0,
            dir: dir.to_array(),
            t_max,
        }
    }

    /// The point at `t`.
    pub fn at(&self, t: f32) -> Vec3 {
        Vec3::from_array(self.origin) + t * Vec3::from_array(self.dir)
    }

    /// Whether every tracer can be expected to answer it.
    pub fn is_valid(&self) -> bool {
        let dir = Vec3::from_array(self.dir);
        Vec3::from_array(self.origin).is_finite()
            && dir.is_finite()
            && dir != Vec3::ZERO
            && 0.0 <= self.t_min
            && self.t_min < self.t_max
    }
}
