use crate::block::{
    BlockTree, CurveBlock, CurveStore, MovingCurveBlock, MovingPairs, MovingSphereBlock,
    SphereBlock,
};
use crate::node::Tree;
use crate::visibility::Visibility;
use kilauea_math::{Bounds3, Vec3};

/// What a tree is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Triangles,
    MovingTriangles,
    Spheres,
    MovingSpheres,
    Curves,
    MovingCurves,
}

/// All trees of a scene, by kind.
#[derive(Clone, Debug, Default)]
pub(crate) struct Forest {
    pub(crate) triangles: Vec<Tree>,
    pub(crate) moving_triangles: Vec<BlockTree<MovingPairs>>,
    pub(crate) spheres: Vec<BlockTree<SphereBlock>>,
    pub(crate) moving_spheres: Vec<BlockTree<MovingSphereBlock>>,
    pub(crate) curves: Vec<BlockTree<CurveBlock>>,
    pub(crate) moving_curves: Vec<BlockTree<MovingCurveBlock>>,
}

/// The primitives of a geometry that share kind, number of motion keys and visibility.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PartTrees {
    pub(crate) kind: Kind,
    /// Index of the first tree of its kind; those of further intervals follow.
    pub(crate) first: u32,
    /// One more than there are intervals between keys; one for what stands still.
    pub(crate) n_keys: u32,
    pub(crate) visibility: Visibility,
}

impl Forest {
    /// Boxes that together hold the part at all times.
    pub(crate) fn boxes(&self, part: &PartTrees) -> Vec<Bounds3> {
        let first = part.first as usize;
        let all = first..first + (part.n_keys.max(2) - 1) as usize;
        match part.kind {
            Kind::Triangles => {
                let root = &self.triangles[first].nodes[0];
                let boxes = root.used_lanes().map(|lane| {
                    let (low, high) = root.lane_bounds(lane);
                    Bounds3 {
                        min: Vec3::from_array(low),
                        max: Vec3::from_array(high),
                    }
                });
                boxes.collect()
            }
            Kind::MovingTriangles => bounds_of(&self.moving_triangles[all]),
            Kind::Spheres => bounds_of(&self.spheres[all]),
            Kind::MovingSpheres => bounds_of(&self.moving_spheres[all]),
            Kind::Curves => bounds_of(&self.curves[all]),
            Kind::MovingCurves => bounds_of(&self.moving_curves[all]),
        }
    }

    /// Memory of nodes and primitives.
    pub(crate) fn n_bytes(&self) -> usize {
        let curves = self.curves.iter().map(|tree| &tree.store);
        let moving_curves = self.moving_curves.iter().map(|tree| &tree.store);
        self.triangles.iter().map(Tree::n_bytes).sum::<usize>()
            + tree_bytes(&self.moving_triangles)
            + tree_bytes(&self.spheres)
            + tree_bytes(&self.moving_spheres)
            + tree_bytes(&self.curves)
            + tree_bytes(&self.moving_curves)
            + curves
                .chain(moving_curves)
                .map(CurveStore::n_bytes)
                .sum::<usize>()
    }
}

fn bounds_of<B: crate::block::Block>(trees: &[BlockTree<B>]) -> Vec<Bounds3> {
    trees.iter().map(|tree| tree.bounds).collect()
}

fn tree_bytes<B: crate::block::Block>(trees: &[BlockTree<B>]) -> usize {
    let bytes = |tree: &BlockTree<B>| {
        size_of_val(tree.nodes.as_slice()) + size_of_val(tree.leaves.as_slice())
    };
    trees.iter().map(bytes).sum()
}
