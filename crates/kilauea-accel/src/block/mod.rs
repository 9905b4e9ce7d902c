//! Leaves of all kinds but still triangles, which have a walk of their own, and trees over them.

mod capsules;
mod curves;
mod moving_pairs;
mod spheres;

pub(crate) use curves::{CurveBlock, CurveStore, MovingCurveBlock, StoredSegment};
pub(crate) use moving_pairs::MovingPairs;
pub(crate) use spheres::{MovingSphereBlock, SphereBlock};

use crate::node::WalkNode;
use crate::primitive::RayFrame;
use crate::traverse::{Kernel, TreeRay};
use kilauea_math::{Bounds3, DVec3};

/// A ray as blocks are tested with it.
pub(crate) struct BlockRay<'a> {
    /// In the space of the tree.
    pub(crate) tree: &'a TreeRay,
    /// Hits are further than this, once rounded.
    pub(crate) t_min: f32,
    /// How far it is from one motion key to the next.
    pub(crate) fraction: f32,
}

impl BlockRay<'_> {
    /// The ray as primitives other than triangles see it.
    #[inline(always)]
    fn frame(&self) -> RayFrame {
        let axes = [0, 1, 2];
        let origin = DVec3::from_array(axes.map(|axis| self.tree.exact_origin(axis)));
        let dir = DVec3::from_array(axes.map(|axis| self.tree.exact_dir(axis)));
        RayFrame::new(origin, dir, self.t_min)
    }
}

/// A leaf: a few primitives that are tested together.
pub(crate) trait Block: Sized {
    /// The nodes above such leaves.
    type Node: WalkNode;
    /// What the blocks of a tree refer to.
    type Store: Send + Sync;
    /// What the tests derive from a ray, once for each tree that it enters.
    type Ray<K: Kernel>;

    /// Derives what the tests read.
    fn ray<K: Kernel>(kernel: K, ray: &BlockRay<'_>) -> Self::Ray<K>;

    /// Calls `offer` with a primitive and where (t, u, v) the ray meets it, for all that it meets
    /// no further than `limit` and some beyond, until `offer` returns true.
    fn intersect<K: Kernel>(
        &self,
        store: &Self::Store,
        kernel: K,
        ray: &Self::Ray<K>,
        limit: Limit,
        offer: impl FnMut(u32, [f32; 3]) -> bool,
    );

    /// The primitives, as hits report them, and boxes around them at both ends of the interval.
    fn primitives(&self, store: &Self::Store) -> Vec<(u32, [Bounds3; 2])>;
}

/// A distance beyond which hits do not matter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limit {
    /// From the ray's origin.
    pub(crate) t: f32,
    /// A bound for it, from where the ray enters the tree.
    pub(crate) in_tree: f32,
}

/// A tree over primitives of one kind.
#[derive(Clone, Debug)]
pub(crate) struct BlockTree<B: Block> {
    pub(crate) nodes: Vec<B::Node>,
    pub(crate) leaves: Vec<B>,
    pub(crate) store: B::Store,
    /// Around all primitives at all times of the tree's interval.
    pub(crate) bounds: Bounds3,
    /// Primitives that leaves hold at least once.
    pub(crate) n_primitives: usize,
}
