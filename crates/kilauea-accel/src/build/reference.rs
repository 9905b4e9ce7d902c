//! What trees are built over: boxes with the number of what is in them.

use kilauea_math::Vec4;
use obvhs::aabb::Aabb;
use obvhs::bvh2::node::Bvh2Node;

/// A leaf of a binary tree, and until it is in one.
pub(crate) type Reference = Bvh2Node;

/// A box around the item `index`.
pub(crate) fn reference(bounds: Aabb, index: u32) -> Reference {
    Bvh2Node::new(bounds, 1, index)
}

/// References to boxes in order.
pub(crate) fn references(boxes: impl IntoIterator<Item = Aabb>) -> Vec<Reference> {
    let numbered = boxes.into_iter().zip(0..);
    numbered
        .map(|(bounds, index)| reference(bounds, index))
        .collect()
}

/// A range of twice the boxes' centers. The fourth components hold no coordinate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Centers {
    pub(super) least: Vec4,
    pub(super) most: Vec4,
}

impl Centers {
    pub(super) const NONE: Self = Self {
        least: Vec4::INFINITY,
        most: Vec4::NEG_INFINITY,
    };

    pub(super) fn of(references: &[Reference]) -> Self {
        references.iter().fold(Self::NONE, |all, reference| {
            let center = doubled_center(reference);
            Self {
                least: all.least.min(center),
                most: all.most.max(center),
            }
        })
    }

    pub(super) fn union(self, other: Self) -> Self {
        Self {
            least: self.least.min(other.least),
            most: self.most.max(other.most),
        }
    }
}

/// Twice the center of the box; the fourth component is a number next to zero.
#[inline]
pub(super) fn doubled_center(reference: &Reference) -> Vec4 {
    let [low, high]: [Vec4; 2] = bytemuck::cast(*reference);
    low + high
}

/// The same along one axis.
#[inline]
pub(super) fn doubled_center_at(reference: &Reference, axis: usize) -> f32 {
    let [low, high]: [[f32; 4]; 2] = bytemuck::cast(*reference);
    low[axis] + high[axis]
}
