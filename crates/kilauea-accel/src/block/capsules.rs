use crate::motion::lerp;
use crate::primitive::{Capsule, RayFrame};
use kilauea_math::DVec3;

/// Four capsules, one lane each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Capsules {
    /// By axis and lane.
    from: [[f32; 4]; 3],
    to: [[f32; 4]; 3],
    /// NaN in unused lanes, which no ray meets.
    radius: [f32; 4],
}

impl Capsules {
    /// At most four.
    pub(super) fn new(capsules: impl IntoIterator<Item = Capsule>) -> Self {
        let mut all = Self {
            from: [[0.0; 4]; 3],
            to: [[0.0; 4]; 3],
            radius: [f32::NAN; 4],
        };
        for (lane, capsule) in capsules.into_iter().enumerate() {
            for axis in 0..3 {
                all.from[axis][lane] = capsule.from[axis];
                all.to[axis][lane] = capsule.to[axis];
            }
            all.radius[lane] = capsule.radius;
        }
        all
    }

    /// Those at `fraction` of the way to the same ones later.
    #[inline(always)]
    pub(super) fn at_time(&self, later: &Self, fraction: f32) -> Self {
        let mut all = *self;
        for lane in 0..4 {
            for axis in 0..3 {
                all.from[axis][lane] =
                    lerp(self.from[axis][lane], later.from[axis][lane], fraction);
                all.to[axis][lane] = lerp(self.to[axis][lane], later.to[axis][lane], fraction);
            }
            all.radius[lane] = lerp(self.radius[lane], later.radius[lane], fraction);
        }
        all
    }

    /// The lanes whose capsules the ray meets between its start and a depth.
    #[inline(always)]
    pub(super) fn met(&self, ray: &RayFrame, limit: f64) -> u32 {
        let [x_axis, y_axis, z_axis] = ray.axes();
        let (origin, start) = (ray.origin(), ray.start());
        // Lane by lane alike, so that compilers turn it into vectors.
        let met: [bool; 4] = std::array::from_fn(|lane| {
            let from_origin = |end: &[[f32; 4]; 3]| {
                let along = |axis: usize| f64::from(end[axis][lane]) - origin[axis];
                [along(0), along(1), along(2)]
            };
            let (from, to) = (from_origin(&self.from), from_origin(&self.to));
            let along = |p: [f64; 3], axis: DVec3| p[0] * axis.x + p[1] * axis.y + p[2] * axis.z;
            let (x, y) = (along(from, x_axis), along(from, y_axis));
            let (dx, dy) = (along(to, x_axis) - x, along(to, y_axis) - y);
            let (z_from, z_to) = (along(from, z_axis), along(to, z_axis));
            let radius = f64::from(self.radius[lane]);

            // Seen along the ray: the point of the line between the ends that is nearest to it.
            let foot = -(x * dx + y * dy) / (dx * dx + dy * dy).max(f64::MIN_POSITIVE);
            let foot = foot.clamp(0.0, 1.0);
            let (x, y) = (x + foot * dx, y + foot * dy);
            let is_near = x * x + y * y <= radius * radius;
            let is_ahead = z_from.max(z_to) + radius > start;
            is_near && is_ahead && z_from.min(z_to) - radius <= limit
        });
        (0..4).fold(0, |mask, lane| mask | u32::from(met[lane]) << lane)
    }
}
