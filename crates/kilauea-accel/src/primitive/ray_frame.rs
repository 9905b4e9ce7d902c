use kilauea_math::DVec3;

/// Where a ray meets a primitive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    /// Distance in lengths of the ray's direction.
    pub(crate) t: f64,
    /// Along a curve's segment, in [0, 1].
    pub(crate) u: f64,
    /// Across a ribbon, in [0, 1]; 0.5 is its axis.
    pub(crate) v: f64,
}

impl Place {
    /// Distance, along, across.
    #[inline]
    pub(crate) fn rounded(self) -> [f32; 3] {
        [self.t as f32, self.u as f32, self.v as f32]
    }
}

/// Orthonormal axes of which z is the direction of a ray, at its origin. Depths are coordinates
/// along z.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayFrame {
    origin: DVec3,
    x: DVec3,
    y: DVec3,
    z: DVec3,
    dir_length: f64,
    /// Where the ray begins: deeper counts.
    start: f64,
}

impl RayFrame {
    /// The frame of the ray whose distances are those that exceed `t_min` when rounded to `f32`.
    pub(crate) fn new(origin: DVec3, dir: DVec3, t_min: f32) -> Self {
        let dir_length = dir.length();
        let z = dir / dir_length;
        let (x, y) = z.any_orthonormal_pair();
        let next = f64::from(t_min.next_up());
        Self {
            origin,
            x,
            y,
            z,
            dir_length,
            start: 0.5 * (f64::from(t_min) + next) * dir_length,
        }
    }

    /// Where the ray starts.
    #[inline]
    pub(crate) fn origin(&self) -> DVec3 {
        self.origin
    }

    /// The axes: the last along the ray.
    #[inline]
    pub(crate) fn axes(&self) -> [DVec3; 3] {
        [self.x, self.y, self.z]
    }

    /// Coordinates of a point.
    #[inline]
    pub(crate) fn local(&self, p: [f32; 3]) -> [f64; 3] {
        let p = DVec3::from_array(p.map(f64::from)) - self.origin;
        [p.dot(self.x), p.dot(self.y), p.dot(self.z)]
    }

    /// Coordinates of a direction.
    #[inline]
    pub(crate) fn local_dir(&self, d: [f32; 3]) -> [f64; 3] {
        let d = DVec3::from_array(d.map(f64::from));
        [d.dot(self.x), d.dot(self.y), d.dot(self.z)]
    }

    /// Where the ray begins.
    #[inline]
    pub(crate) fn start(&self) -> f64 {
        self.start
    }

    /// The depth at distance `t`.
    #[inline]
    pub(crate) fn depth(&self, t: f32) -> f64 {
        f64::from(t) * self.dir_length
    }

    /// The distance to `depth`.
    #[inline]
    pub(crate) fn distance(&self, depth: f64) -> f64 {
        depth / self.dir_length
    }
}
