//! Queries: leaves of triangles, and instances above them.

use super::general::{Part, PartLeaves};
use super::keep::Keep;
use super::kernel::{Distances, Kernel};
use super::search::Search;
use super::tree_ray::{Ball, TreeRay};
use super::triangle;
use super::walk::{Visitor, any_order, near_first};
use crate::forest::Forest;
use crate::node::{Node8, Tree};
use crate::ray::{Hit, Ray};
use kilauea_math::DAffine3;

/// What a walk goes through.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Scene<'a> {
    /// Triangles in engine space.
    Single(&'a Tree),
    /// A tree whose leaves are instances of triangles that stand still and that all rays meet.
    Instanced {
        top: &'a [Node8],
        instances: &'a [Instance],
        trees: &'a [Tree],
    },
    /// A tree whose leaves are instances of anything.
    General {
        top: &'a [Node8],
        instances: &'a [Instance],
        parts: &'a [Part],
        forest: &'a Forest,
    },
}

/// A tree put into engine space.
#[derive(Clone, Debug)]
pub(crate) struct Instance {
    pub(crate) tree: u32,
    /// What hits report; added to that of the triangles, which have one where they are baked.
    pub(crate) id_base: u32,
    /// `None` where the tree is in engine space.
    pub(crate) geometry_from_world: Option<DAffine3>,
    /// Around the tree at all times.
    pub(crate) ball: Ball,
}

impl Instance {
    /// The ray in the tree's space.
    #[inline(always)]
    pub(super) fn tree_ray(&self, ray: &Ray, world_ray: &TreeRay) -> TreeRay {
        match &self.geometry_from_world {
            None => *world_ray,
            Some(geometry_from_world) => TreeRay::transformed(geometry_from_world, ray, &self.ball),
        }
    }
}

/// The first hit in the order of [`Hit::wins_over`] that `keep` accepts.
#[inline(always)]
pub(crate) fn closest<K: Kernel>(
    kernel: K,
    scene: Scene<'_>,
    ray: &Ray,
    keep: impl Keep,
) -> Option<Hit> {
    let mut search = Search::new(ray, keep);
    let world_ray = TreeRay::world(ray);
    match scene {
        Scene::Single(tree) => closest_in_tree(kernel, tree, &world_ray, 0, &mut search),
        Scene::Instanced {
            top,
            instances,
            trees,
        } => {
            let mut visitor = TopLeaves::<_, _, false> {
                kernel,
                instances,
                trees,
                ray,
                world_ray: &world_ray,
                search: &mut search,
            };
            near_first(
                kernel,
                (top, 0.0),
                &kernel.node_ray(&world_ray),
                &mut visitor,
            );
        }
        Scene::General {
            top,
            instances,
            parts,
            forest,
        } => {
            let mut visitor = PartLeaves::<_, _, false> {
                kernel,
                instances,
                parts,
                forest,
                ray,
                world_ray: &world_ray,
                search: &mut search,
            };
            near_first(
                kernel,
                (top, 0.0),
                &kernel.node_ray(&world_ray),
                &mut visitor,
            );
        }
    }
    (search.best.primitive != u32::MAX).then_some(search.best)
}

/// Whether `keep` accepts any hit.
#[inline(always)]
pub(crate) fn occluded<K: Kernel>(kernel: K, scene: Scene<'_>, ray: &Ray, keep: impl Keep) -> bool {
    let mut search = Search::new(ray, keep);
    let world_ray = TreeRay::world(ray);
    match scene {
        Scene::Single(tree) => any_in_tree(kernel, tree, &world_ray, 0, &mut search),
        Scene::Instanced {
            top,
            instances,
            trees,
        } => {
            let mut visitor = TopLeaves::<_, _, true> {
                kernel,
                instances,
                trees,
                ray,
                world_ray: &world_ray,
                search: &mut search,
            };
            any_order(
                kernel,
                (top, 0.0),
                &kernel.node_ray(&world_ray),
                &mut visitor,
            )
        }
        Scene::General {
            top,
            instances,
            parts,
            forest,
        } => {
            let mut visitor = PartLeaves::<_, _, true> {
                kernel,
                instances,
                parts,
                forest,
                ray,
                world_ray: &world_ray,
                search: &mut search,
            };
            any_order(
                kernel,
                (top, 0.0),
                &kernel.node_ray(&world_ray),
                &mut visitor,
            )
        }
    }
}

/// Leaves of triangles.
///
/// Positions in `f64` are found for hits that need them: where rounding could change what wins,
/// and once more for the winner. Until then a hit that is certain stands by the bounds of its
/// distance.
struct TreeLeaves<'a, K: Kernel, F, const ANY: bool> {
    kernel: K,
    tree: &'a Tree,
    ray: &'a TreeRay,
    leaf_ray: K::LeafRay,
    id_base: u32,
    /// The best hit so far is not nearer than this ...
    nearest: f32,
    /// ... nor beyond this.
    limit: f32,
    /// Of the certain hits of a leaf; kept here so that it is made once.
    distances: Distances,
    /// Leaf and lane of the best hit, while its position is not known.
    pending: Option<(u32, usize)>,
    search: &'a mut Search<F>,
}

impl<'a, K: Kernel, F: Keep, const ANY: bool> TreeLeaves<'a, K, F, ANY> {
    #[inline(always)]
    fn new(
        kernel: K,
        tree: &'a Tree,
        ray: &'a TreeRay,
        id_base: u32,
        search: &'a mut Search<F>,
    ) -> Self {
        let (nearest, limit) = ray.distance_bounds(search.best.t);
        Self {
            kernel,
            tree,
            ray,
            leaf_ray: kernel.leaf_ray(ray),
            id_base,
            nearest,
            limit,
            distances: Distances::NONE,
            pending: None,
            search,
        }
    }

    /// Finds where the ray meets the triangle, and takes that if it wins.
    #[inline(always)]
    fn offer(&mut self, leaf: u32, lane: usize) -> bool {
        let leaf = self.kernel.item(&self.tree.leaves, leaf);
        let wins = triangle::intersect(&leaf.lane(lane), self.ray)
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
}

impl<K: Kernel, F: Keep, const ANY: bool> Visitor for TreeLeaves<'_, K, F, ANY> {
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.limit
    }

    #[inline(always)]
    fn visit(&mut self, leaf: u32) -> bool {
        let block = self.kernel.item(&self.tree.leaves, leaf);
        let candidates =
            self.kernel
                .candidates(&self.leaf_ray, self.limit, block, &mut self.distances);
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

#[inline(always)]
pub(super) fn closest_in_tree<K: Kernel>(
    kernel: K,
    tree: &Tree,
    ray: &TreeRay,
    id_base: u32,
    search: &mut Search<impl Keep>,
) {
    let mut visitor = TreeLeaves::<_, _, false>::new(kernel, tree, ray, id_base, search);
    let nodes = (&tree.nodes[..], 0.0);
    near_first(kernel, nodes, &kernel.node_ray(ray), &mut visitor);
    visitor.settle();
}

#[inline(always)]
pub(super) fn any_in_tree<K: Kernel>(
    kernel: K,
    tree: &Tree,
    ray: &TreeRay,
    id_base: u32,
    search: &mut Search<impl Keep>,
) -> bool {
    let mut visitor = TreeLeaves::<_, _, true>::new(kernel, tree, ray, id_base, search);
    let nodes = (&tree.nodes[..], 0.0);
    any_order(kernel, nodes, &kernel.node_ray(ray), &mut visitor)
}

/// Leaves of instances.
struct TopLeaves<'a, K, F, const ANY: bool> {
    kernel: K,
    instances: &'a [Instance],
    trees: &'a [Tree],
    ray: &'a Ray,
    world_ray: &'a TreeRay,
    search: &'a mut Search<F>,
}

impl<K: Kernel, F: Keep, const ANY: bool> Visitor for TopLeaves<'_, K, F, ANY> {
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.search.best.t
    }

    #[inline(always)]
    fn visit(&mut self, leaf: u32) -> bool {
        let instance = self.kernel.item(self.instances, leaf);
        let tree = self.kernel.item(self.trees, instance.tree);
        let ray = instance.tree_ray(self.ray, self.world_ray);
        if ANY {
            any_in_tree(self.kernel, tree, &ray, instance.id_base, self.search)
        } else {
            closest_in_tree(self.kernel, tree, &ray, instance.id_base, self.search);
            false
        }
    }

    #[inline(always)]
    fn address(&self, leaf: u32) -> *const u8 {
        self.instances.as_ptr().wrapping_add(leaf as usize).cast()
    }
}
