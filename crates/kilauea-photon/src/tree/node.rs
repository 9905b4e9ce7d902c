use kilauea_math::{Bounds3, Vec3};

use super::WIDTH;

/// The boxes of up to eight children; those that are missing are infinitely far from everything.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    min_x: [f32; WIDTH],
    min_y: [f32; WIDTH],
    min_z: [f32; WIDTH],
    max_x: [f32; WIDTH],
    max_y: [f32; WIDTH],
    max_z: [f32; WIDTH],
}

impl Node {
    /// A node of at most eight children.
    pub(crate) fn new(children: impl Iterator<Item = Bounds3>) -> Self {
        let far = [f32::INFINITY; WIDTH];
        let mut node = Self {
            min_x: far,
            min_y: far,
            min_z: far,
            max_x: far,
            max_y: far,
            max_z: far,
        };
        for (lane, Bounds3 { min, max }) in children.enumerate() {
            (node.min_x[lane], node.max_x[lane]) = (min.x, max.x);
            (node.min_y[lane], node.max_y[lane]) = (min.y, max.y);
            (node.min_z[lane], node.max_z[lane]) = (min.z, max.z);
        }
        node
    }

    /// Around all children.
    pub(crate) fn bounds(&self) -> Bounds3 {
        (0..WIDTH)
            .filter(|&lane| self.min_x[lane] < f32::INFINITY)
            .fold(Bounds3::EMPTY, |all, lane| {
                all.union(&Bounds3 {
                    min: Vec3::new(self.min_x[lane], self.min_y[lane], self.min_z[lane]),
                    max: Vec3::new(self.max_x[lane], self.max_y[lane], self.max_z[lane]),
                })
            })
    }

    /// Squared distances from `p` to the boxes.
    #[inline]
    pub(crate) fn distances_sq(&self, p: Vec3) -> [f32; WIDTH] {
        std::array::from_fn(|lane| {
            let x = outside(self.min_x[lane], p.x, self.max_x[lane]);
            let y = outside(self.min_y[lane], p.y, self.max_y[lane]);
            let z = outside(self.min_z[lane], p.z, self.max_z[lane]);
            x * x + y * y + z * z
        })
    }
}

/// How far `v` is outside of an interval. Comparisons instead of `f32::max`, which takes three
/// instructions more to care for NaNs.
#[inline(always)]
fn outside(min: f32, v: f32, max: f32) -> f32 {
    let (below, above) = (min - v, v - max);
    let either = if below > above { below } else { above };
    if either > 0.0 { either } else { 0.0 }
}
