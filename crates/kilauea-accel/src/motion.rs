//! Motion within the shutter: keys evenly spaced, straight lines between them.

use crate::node::{LEAF, Node8, WalkNode};
use kilauea_math::{Bounds3, DAffine3, Vec3};
use std::ops::Deref;

/// The interval between keys that holds `time`, and how far into it that is, in [0, 1].
#[inline(always)]
pub(crate) fn interval(n_keys: u32, time: f32) -> (u32, f32) {
    let n_intervals = n_keys.saturating_sub(1).max(1);
    let scaled = time.clamp(0.0, 1.0) * n_intervals as f32;
    let index = (scaled as u32).min(n_intervals - 1);
    (index, scaled - index as f32)
}

/// The matrix at `time`, interpolated linearly.
pub(crate) fn matrix_at(keys: &[DAffine3], time: f32) -> DAffine3 {
    let (index, fraction) = interval(keys.len() as u32, time);
    let first = keys[index as usize];
    let Some(second) = keys.get(index as usize + 1) else {
        return first;
    };
    let fraction = f64::from(fraction);
    DAffine3 {
        matrix3: first.matrix3 * (1.0 - fraction) + second.matrix3 * fraction,
        translation: first.translation.lerp(second.translation, fraction),
    }
}

#[inline(always)]
pub(crate) fn lerp(a: f32, b: f32, fraction: f32) -> f32 {
    a + fraction * (b - a)
}

/// Boxes at both ends of an interval between keys. What moves in straight lines between them is
/// always within the boxes interpolated alike.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct MotionNode8 {
    /// As [`Node8::planes`], at either end.
    pub(crate) planes: [[[f32; 8]; 6]; 2],
    pub(crate) child: [u32; 8],
}

/// A node computed for the moment.
pub(crate) struct Moment(Node8);

impl Deref for Moment {
    type Target = Node8;

    #[inline(always)]
    fn deref(&self) -> &Node8 {
        &self.0
    }
}

impl WalkNode for MotionNode8 {
    type Still<'a> = Moment;

    #[inline(always)]
    fn at(&self, fraction: f32) -> Moment {
        let mut node = Node8 {
            child: self.child,
            ..Node8::NONE
        };
        for plane in 0..6 {
            for lane in 0..8 {
                let [first, last] = [0, 1].map(|end| self.planes[end][plane][lane]);
                node.planes[plane][lane] = lerp(first, last, fraction);
            }
        }
        Moment(node)
    }

    fn over(nodes: Vec<Node8>, leaf_boxes: impl Fn(usize) -> [Bounds3; 2]) -> Vec<Self> {
        let mut moving: Vec<Self> = nodes.iter().map(Self::without_boxes).collect();
        // Children come after their parents.
        for (index, node) in nodes.iter().enumerate().rev() {
            for lane in node.used_lanes() {
                let link = node.child[lane];
                let boxes = if link & LEAF == 0 {
                    [0, 1].map(|end| moving[link as usize].bounds(end))
                } else {
                    leaf_boxes((link & !LEAF) as usize)
                };
                for (end, bounds) in grown(boxes).into_iter().enumerate() {
                    for axis in 0..3 {
                        moving[index].planes[end][2 * axis][lane] = bounds.min[axis];
                        moving[index].planes[end][2 * axis + 1][lane] = bounds.max[axis];
                    }
                }
            }
        }
        moving
    }
}

impl MotionNode8 {
    /// The links of `node`, and boxes that no ray meets, finite so that they can be interpolated.
    fn without_boxes(node: &Node8) -> Self {
        const BEYOND: f32 = 1e38;
        let (low, high) = ([BEYOND; 8], [-BEYOND; 8]);
        Self {
            planes: [[low, high, low, high, low, high]; 2],
            child: node.child,
        }
    }

    /// A box around all children at one end.
    fn bounds(&self, end: usize) -> Bounds3 {
        let row = |plane: usize| self.planes[end][plane].iter().copied();
        let low = [0, 2, 4].map(|plane| row(plane).fold(f32::INFINITY, f32::min));
        let high = [1, 3, 5].map(|plane| row(plane).fold(f32::NEG_INFINITY, f32::max));
        Bounds3 {
            min: Vec3::from_array(low),
            max: Vec3::from_array(high),
        }
    }
}

/// Boxes larger by what interpolation rounds away of their own planes and of what is inside.
fn grown(boxes: [Bounds3; 2]) -> [Bounds3; 2] {
    const ULP: f32 = f32::EPSILON;
    const LEAST: f32 = 1e-30;
    let size = |b: &Bounds3| b.min.abs().max(b.max.abs());
    let margin = size(&boxes[0]).max(size(&boxes[1])) * (8.0 * ULP) + LEAST;
    boxes.map(|b| Bounds3 {
        min: b.min - margin,
        max: b.max + margin,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_math::DVec3;

    #[test]
    fn times_fall_into_intervals() {
        assert_eq!(interval(1, 0.7), (0, 0.7));
        assert_eq!(interval(3, 0.0), (0, 0.0));
        assert_eq!(interval(3, 0.75), (1, 0.5));
        assert_eq!(interval(3, 1.0), (1, 1.0));
        assert_eq!(interval(3, -2.0), (0, 0.0));
        assert_eq!(interval(3, 9.0), (1, 1.0));
    }

    #[test]
    fn matrices_are_those_of_the_keys_at_the_keys() {
        let keys = [1.0, 5.0, 2.0].map(|x| DAffine3::from_scale(DVec3::new(x, 1.0, -x)));
        assert_eq!(matrix_at(&keys, 0.0), keys[0]);
        assert_eq!(matrix_at(&keys, 0.5), keys[1]);
        assert_eq!(matrix_at(&keys, 1.0), keys[2]);
        assert_eq!(matrix_at(&keys, 0.25).matrix3.x_axis.x, 3.0);
        assert_eq!(matrix_at(&keys[..1], 0.4), keys[0]);
    }
}
