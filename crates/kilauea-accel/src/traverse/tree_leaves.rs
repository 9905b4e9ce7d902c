//! The walk through one tree of still triangles.

use super::keep::Keep;
use super::kernel::{Distances, Kernel};
use super::search::Search;
use super::tree_ray::{Line, TreeRay};
use super::walk::{Visitor, walk};
use crate::node::Tree;

/// Leaves of triangles.
///
/// Positions in `f64` are found for hits that need them: where rounding could change what wins,
/// and once more for the winner. Until then a hit that is certain stands by the bounds of its
/// distance.
struct TreeLeaves<'a, K: Kernel, L, F, const ANY: bool> {
    kernel: K,
    tree: &'a Tree,
    ray: &'a TreeRay<L>,
    /// Apart, and so in memory: all lanes read it as they need it.
    leaf_ray: &'a K::LeafRay,
    id_base: u32,
    /// The best hit so far is not nearer than this ...
    nearest: f32,
    /// ... nor beyond this.
    limit: f32,
    /// Of the certain hits of a leaf. Lanes are looked up by number, which would keep all that is
    /// stored beside them from staying in registers.
    distances: &'a mut Distances,
    /// Leaf and lane of the best hit, while its position is not known.
    pending: Option<(u32, usize)>,
    search: &'a mut Search<F>,
}

impl<'a, K: Kernel, L: Line, F: Keep, const ANY: bool> TreeLeaves<'a, K, L, F, ANY> {
    #[inline(always)]
    fn new(
        kernel: K,
        tree: &'a Tree,
        ray: &'a TreeRay<L>,
        leaf_ray: &'a K::LeafRay,
        id_base: u32,
        distances: &'a mut Distances,
        search: &'a mut Search<F>,
    ) -> Self {
        let (nearest, limit) = ray.distance_bounds(search.best.t);
        Self {
            kernel,
            tree,
            ray,
            leaf_ray,
            id_base,
            nearest,
            limit,
            distances,
            pending: None,
            search,
        }
    }

    /// Finds where the ray meets the triangle, and takes that if it wins.
    #[inline(always)]
    fn offer(&mut self, leaf: u32, lane: usize) -> bool {
        let leaf = self.kernel.item(&self.tree.leaves, leaf);
        let rays = (self.ray, self.leaf_ray);
        let wins = self
            .kernel
            .position_apart(rays, leaf, lane)
            .is_some_and(|place| self.search.offer(leaf.hit(lane, place, self.id_base)));
        if wins {
            (self.nearest, self.limit) = self.ray.distance_bounds(self.search.best.t);
        }
        wins
    }

    /// Finds where the best hit is, if that is still to do.
    #[inline(always)]
    fn settle(&mut self) {
        if let Some((leaf, lane)) = self.pending.take() {
            let wins = self.offer(leaf, lane);
            debug_assert!(wins, "a certain hit was none");
        }
    }

    /// The same once the walk has ended. What is certain wins by its bounds: nobody needs to ask.
    #[inline(always)]
    fn finish(self) {
        let Some((leaf, lane)) = self.pending else {
            return;
        };
        let leaf = self.kernel.item(&self.tree.leaves, leaf);
        let rays = (self.ray, self.leaf_ray);
        let place = self.kernel.position(rays, leaf, lane);
        debug_assert!(place.is_some(), "a certain hit was none");
        if let Some(place) = place {
            let hit = leaf.hit(lane, place, self.id_base);
            debug_assert!(self.search.t_min < hit.t && hit.wins_over(&self.search.best));
            self.search.best = hit;
        }
    }
}

impl<K: Kernel, L: Line, F: Keep, const ANY: bool> Visitor for TreeLeaves<'_, K, L, F, ANY> {
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.limit
    }

    #[inline(always)]
    fn visit(&mut self, leaf: u32) -> bool {
        let block = self.kernel.item(&self.tree.leaves, leaf);
        let candidates = self
            .kernel
            .candidates(self.leaf_ray, self.limit, block, self.distances);
        if ANY && F::ALL && candidates.certain != 0 {
            return true;
        }
        let mut open = candidates.possible;
        while open != 0 {
            let lane = (open.trailing_zeros() & 7) as usize;
            open &= open - 1;
            let is_certain = F::ALL && candidates.certain >> lane & 1 != 0;
            if is_certain && self.distances.furthest.0[lane] < self.nearest {
                self.nearest = self.distances.nearest.0[lane];
                self.limit = self.distances.furthest.0[lane];
                self.pending = Some((leaf, lane));
            } else if !is_certain || self.distances.nearest.0[lane] <= self.limit {
                // A line through where it starts on a triangle passes within it, and in `f32` it
                // takes an exact look to tell that it does so no further on.
                if !is_certain && block.id(lane, self.id_base) == self.search.from {
                    continue;
                }
                self.settle();
                if self.offer(leaf, lane) && ANY {
                    return true;
                }
            }
        }
        false
    }

    #[inline(always)]
    fn address(&self, leaf: u32) -> *const u8 {
        self.tree.leaves.as_ptr().wrapping_add(leaf as usize).cast()
    }
}

/// Searches one tree; true where `ANY` hit was asked for and found.
#[inline(always)]
pub(crate) fn visit_tree<K: Kernel, F: Keep, const ANY: bool>(
    kernel: K,
    tree: &Tree,
    ray: &TreeRay<impl Line>,
    id_base: u32,
    search: &mut Search<F>,
) -> bool {
    let mut distances = Distances::NONE;
    let leaf_ray = kernel.leaf_ray(ray);
    let mut visitor = TreeLeaves::<_, _, _, ANY>::new(
        kernel,
        tree,
        ray,
        &leaf_ray,
        id_base,
        &mut distances,
        search,
    );
    let nodes = (&tree.nodes[..], 0.0);
    let is_found = walk::<_, _, ANY>(kernel, nodes, &kernel.node_ray(ray), &mut visitor);
    if !ANY {
        visitor.finish();
    }
    is_found
}
