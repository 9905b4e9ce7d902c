use kilauea_math::{Bounds3, Vec3};

use super::WIDTH;

/// Eight points, or fewer with NaNs after them, which are near nothing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointBlock {
    x: [f32; WIDTH],
    y: [f32; WIDTH],
    z: [f32; WIDTH],
}

impl PointBlock {
    /// A block of at most eight points.
    pub(crate) fn new(points: impl Iterator<Item = Vec3>) -> Self {
        let mut block = Self {
            x: [f32::NAN; WIDTH],
            y: [f32::NAN; WIDTH],
            z: [f32::NAN; WIDTH],
        };
        for (lane, p) in points.enumerate() {
            (block.x[lane], block.y[lane], block.z[lane]) = (p.x, p.y, p.z);
        }
        block
    }

    #[inline]
    pub(crate) fn point(&self, lane: usize) -> Vec3 {
        Vec3::new(self.x[lane], self.y[lane], self.z[lane])
    }

    pub(crate) fn bounds(&self) -> Bounds3 {
        let points = (0..WIDTH).map(|lane| self.point(lane));
        Bounds3::from_points(points.filter(|p| !p.is_nan()))
    }

    /// Squared distances to `p`.
    #[inline]
    pub(crate) fn distances_sq(&self, p: Vec3) -> [f32; WIDTH] {
        std::array::from_fn(|lane| {
            let x = self.x[lane] - p.x;
            let y = self.y[lane] - p.y;
            let z = self.z[lane] - p.z;
            x * x + y * y + z * z
        })
    }
}
