//! Points in blocks of eight and a tree of eight boxes a node above them, with the walks over it.

mod block;
mod build;
mod nearest;
mod node;
mod order;
mod within;

pub use nearest::Found;

use block::PointBlock;
use kilauea_math::Vec3;
use node::Node;

/// Points in each block, and children of each node.
const WIDTH: usize = 8;

/// Levels of nodes that suffice for 2³² points in blocks of eight.
const MAX_LEVELS: usize = 10;

/// A tree over points that have an index each.
///
/// It is implicit: child `i` of node `j` is number `8 j + i` of the level below, so that there are
/// no pointers, and as many levels as the number of points needs, wherever they lie.
#[derive(Clone, Debug, Default)]
pub(crate) struct PointTree {
    n_points: usize,
    blocks: Vec<PointBlock>,
    /// Level by level, the one above the blocks first, the root last.
    nodes: Vec<Node>,
    /// Where in `nodes` each level begins.
    level_starts: Vec<usize>,
}

impl PointTree {
    /// Memory of blocks and nodes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.blocks.as_slice()) + size_of_val(self.nodes.as_slice())
    }

    /// Where the point at a place of the tree's order lies.
    #[inline]
    pub(crate) fn point(&self, idx: usize) -> Vec3 {
        self.blocks[idx / WIDTH].point(idx % WIDTH)
    }

    #[inline]
    fn node(&self, level: usize, idx: usize) -> &Node {
        &self.nodes[self.level_starts[level] + idx]
    }
}

/// The square of a radius, below the infinity of missing children.
#[inline]
fn bound_sq(radius: f32) -> f32 {
    let radius = radius.max(0.0);
    (radius * radius).min(f32::MAX)
}
