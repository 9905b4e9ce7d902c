//! The walk over instances of all kinds of trees, for scenes that have more than still triangles.

use super::keep::Keep;
use super::kernel::Kernel;
use super::search::Search;
use super::tree_leaves::visit_tree;
use super::tree_ray::TreeRay;
use super::two_level::Instance;
use super::walk::{Visitor, walk};
use crate::block::{Block, BlockRay, BlockTree, Limit};
use crate::forest::{Forest, Kind};
use crate::motion::{interval, matrix_at};
use crate::ray::{Hit, Ray};
use crate::visibility::Visibility;
use kilauea_math::DAffine3;

/// What an instance is made of.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub(crate) kind: Kind,
    /// Motion keys of the primitives; one where they stand still.
    pub(crate) n_keys: u32,
    pub(crate) visibility: Visibility,
    /// By motion key, for instances that move.
    pub(crate) world_from_geometry: Option<Box<[DAffine3]>>,
}

/// Leaves of instances.
pub(crate) struct PartLeaves<'a, K, F, const ANY: bool> {
    pub(crate) kernel: K,
    pub(crate) instances: &'a [Instance],
    pub(crate) parts: &'a [Part],
    pub(crate) forest: &'a Forest,
    pub(crate) ray: &'a Ray,
    pub(crate) world_ray: &'a TreeRay,
    pub(crate) search: &'a mut Search<F>,
}

impl<K: Kernel, F: Keep, const ANY: bool> Visitor for PartLeaves<'_, K, F, ANY> {
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.search.best.t
    }

    #[inline(always)]
    fn visit(&mut self, leaf: u32) -> bool {
        let part = self.kernel.item(self.parts, leaf);
        if !part.visibility.meets(self.ray.visibility) {
            return false;
        }
        let instance = self.kernel.item(self.instances, leaf);
        let ray = match &part.world_from_geometry {
            None => instance.tree_ray(self.ray, self.world_ray),
            Some(keys) => {
                let geometry_from_world = matrix_at(keys, self.ray.time).inverse();
                if !geometry_from_world.is_finite() {
                    // Flat for a moment.
                    return false;
                }
                TreeRay::transformed(&geometry_from_world, self.ray, &instance.ball)
            }
        };
        let forest = self.forest;
        match part.kind {
            Kind::Triangles => {
                let tree = self.kernel.item(&forest.triangles, instance.tree);
                visit_tree::<_, _, ANY>(self.kernel, tree, &ray, instance.id_base, self.search)
            }
            Kind::MovingTriangles => self.visit_blocks(&forest.moving_triangles, leaf, &ray),
            Kind::Spheres => self.visit_blocks(&forest.spheres, leaf, &ray),
            Kind::MovingSpheres => self.visit_blocks(&forest.moving_spheres, leaf, &ray),
            Kind::Curves => self.visit_blocks(&forest.curves, leaf, &ray),
            Kind::MovingCurves => self.visit_blocks(&forest.moving_curves, leaf, &ray),
        }
    }

    #[inline(always)]
    fn address(&self, leaf: u32) -> *const u8 {
        self.instances.as_ptr().wrapping_add(leaf as usize).cast()
    }
}

impl<K: Kernel, F: Keep, const ANY: bool> PartLeaves<'_, K, F, ANY> {
    /// Walks the tree of the instance `leaf` for the interval that the ray's time falls into.
    #[inline(always)]
    fn visit_blocks<B: Block>(
        &mut self,
        trees: &[BlockTree<B>],
        leaf: u32,
        tree_ray: &TreeRay,
    ) -> bool {
        let kernel = self.kernel;
        let instance = kernel.item(self.instances, leaf);
        let part = kernel.item(self.parts, leaf);
        let (index, fraction) = interval(part.n_keys, self.ray.time);
        let tree = kernel.item(trees, instance.tree + index);
        let block_ray = BlockRay {
            tree: tree_ray,
            t_min: self.search.t_min,
            fraction,
        };
        let mut visitor = BlockLeaves::<_, _, _, ANY> {
            kernel,
            tree,
            tree_ray,
            ray: B::ray(kernel, &block_ray),
            id_base: instance.id_base,
            limit: tree_ray.distance_bounds(self.search.best.t).1,
            search: self.search,
        };
        let nodes = (&tree.nodes[..], fraction);
        let node_ray = kernel.node_ray(tree_ray);
        walk::<_, _, ANY>(kernel, nodes, &node_ray, &mut visitor)
    }
}

/// Leaves of blocks.
struct BlockLeaves<'a, K: Kernel, B: Block, F, const ANY: bool> {
    kernel: K,
    tree: &'a BlockTree<B>,
    tree_ray: &'a TreeRay,
    ray: B::Ray<K>,
    id_base: u32,
    limit: f32,
    search: &'a mut Search<F>,
}

impl<K: Kernel, B: Block, F: Keep, const ANY: bool> Visitor for BlockLeaves<'_, K, B, F, ANY> {
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.limit
    }

    #[inline(always)]
    fn visit(&mut self, leaf: u32) -> bool {
        let block = self.kernel.item(&self.tree.leaves, leaf);
        let limit = Limit {
            t: self.search.best.t,
            in_tree: self.limit,
        };
        let (search, instance) = (&mut *self.search, self.id_base);
        let mut is_done = false;
        let offer = |primitive, [t, u, v]: [f32; 3]| {
            let is_better = search.offer(Hit {
                t,
                u,
                v,
                primitive,
                instance,
            });
            is_done = ANY && is_better;
            is_done
        };
        block.intersect(&self.tree.store, self.kernel, &self.ray, limit, offer);
        self.limit = self.tree_ray.distance_bounds(self.search.best.t).1;
        is_done
    }

    #[inline(always)]
    fn address(&self, leaf: u32) -> *const u8 {
        self.tree.leaves.as_ptr().wrapping_add(leaf as usize).cast()
    }
}
