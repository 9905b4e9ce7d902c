use super::{Block, BlockRay, Limit};
use crate::motion::MotionNode8;
use crate::node::PairLeaf;
use crate::traverse::{Distances, Kernel, TreeRay};
use kilauea_math::{Bounds3, Vec3};

/// Triangles whose corners move. All that share a corner move it alike, so that a closed mesh is
/// closed at any time.
#[derive(Clone, Debug)]
pub(crate) struct MovingPairs {
    /// The same triangles as an interval begins and ends.
    pub(crate) ends: [PairLeaf; 2],
}

/// See [`Block::Ray`].
pub(crate) struct PairRay<K: Kernel> {
    leaf_ray: K::LeafRay,
    tree_ray: TreeRay,
    fraction: f32,
}

impl Block for MovingPairs {
    type Node = MotionNode8;
    type Store = ();
    type Ray<K: Kernel> = PairRay<K>;

    #[inline(always)]
    fn ray<K: Kernel>(kernel: K, ray: &BlockRay<'_>) -> PairRay<K> {
        PairRay {
            leaf_ray: kernel.leaf_ray(ray.tree),
            tree_ray: *ray.tree,
            fraction: ray.fraction,
        }
    }

    #[inline(always)]
    fn intersect<K: Kernel>(
        &self,
        (): &(),
        kernel: K,
        ray: &PairRay<K>,
        limit: Limit,
        mut offer: impl FnMut(u32, [f32; 3]) -> bool,
    ) {
        let leaf = self.ends[0].between(&self.ends[1], ray.fraction);
        let mut distances = Distances::NONE;
        let candidates = kernel.candidates(&ray.leaf_ray, limit.in_tree, &leaf, &mut distances);
        let mut open = candidates.possible;
        while open != 0 {
            let lane = (open.trailing_zeros() & 7) as usize;
            open &= open - 1;
            if let Some(place) = kernel.position((&ray.tree_ray, &ray.leaf_ray), &leaf, lane)
                && offer(leaf.triangle[lane], place)
            {
                return;
            }
        }
    }

    fn primitives(&self, (): &()) -> Vec<(u32, [Bounds3; 2])> {
        let bounds = |leaf: &PairLeaf, lane| {
            Bounds3::from_points(leaf.lane(lane).corners().map(Vec3::from_array))
        };
        self.ends[0]
            .used_lanes()
            .map(|lane| {
                let boxes = [0, 1].map(|end| bounds(&self.ends[end], lane));
                (self.ends[0].triangle[lane], boxes)
            })
            .collect()
    }
}
