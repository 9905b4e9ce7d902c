//! Queries of scenes, and instances of still triangles.

use super::general::{Part, PartLeaves};
use super::keep::Keep;
use super::kernel::Kernel;
use super::search::Search;
use super::tree_leaves::visit_tree;
use super::tree_ray::{Ball, Line, TreeRay};
use super::walk::{Visitor, walk};
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

/// The first hit in the order of [`Hit::wins_over`] that `keep` accepts. `tree_ray` makes
/// the form of the ray that trees are asked with.
#[inline(always)]
pub(crate) fn closest<K: Kernel, L: Line>(
    kernel: K,
    scene: Scene<'_>,
    (ray, tree_ray): (&Ray, impl FnOnce() -> TreeRay<L>),
    keep: impl Keep,
) -> Option<Hit> {
    let mut search = Search::new(ray, keep);
    visit::<_, _, false>(kernel, scene, (ray, &tree_ray()), &mut search);
    (search.best.primitive != u32::MAX).then_some(search.best)
}

/// Whether `keep` accepts any hit.
#[inline(always)]
pub(crate) fn occluded<K: Kernel, L: Line>(
    kernel: K,
    scene: Scene<'_>,
    (ray, tree_ray): (&Ray, impl FnOnce() -> TreeRay<L>),
    keep: impl Keep,
) -> bool {
    let search = &mut Search::new(ray, keep);
    visit::<_, _, true>(kernel, scene, (ray, &tree_ray()), search)
}

/// Visits leaves of a tree over boxes until one ends that.
#[inline(always)]
pub(crate) fn pierce<K: Kernel, L: Line>(
    kernel: K,
    nodes: &[Node8],
    ray: &TreeRay<L>,
    visitor: &mut impl Visitor,
) {
    walk::<_, _, true>(kernel, (nodes, 0.0), &kernel.node_ray(ray), visitor);
}

/// Searches all trees; true where `ANY` hit was asked for and found.
#[inline(always)]
fn visit<K: Kernel, F: Keep, const ANY: bool>(
    kernel: K,
    scene: Scene<'_>,
    (ray, world_ray): (&Ray, &TreeRay<impl Line>),
    search: &mut Search<F>,
) -> bool {
    match scene {
        Scene::Single(tree) => visit_tree::<_, _, ANY>(kernel, tree, world_ray, 0, search),
        Scene::Instanced {
            top,
            instances,
            trees,
        } => {
            let mut visitor = TopLeaves::<_, _, ANY> {
                kernel,
                instances,
                trees,
                ray,
                world_ray: &world_ray.moved(),
                search,
            };
            let node_ray = kernel.node_ray(world_ray);
            walk::<_, _, ANY>(kernel, (top, 0.0), &node_ray, &mut visitor)
        }
        Scene::General {
            top,
            instances,
            parts,
            forest,
        } => {
            let mut visitor = PartLeaves::<_, _, ANY> {
                kernel,
                instances,
                parts,
                forest,
                ray,
                world_ray: &world_ray.moved(),
                search,
            };
            let node_ray = kernel.node_ray(world_ray);
            walk::<_, _, ANY>(kernel, (top, 0.0), &node_ray, &mut visitor)
        }
    }
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
        visit_tree::<_, _, ANY>(self.kernel, tree, &ray, instance.id_base, self.search)
    }

    #[inline(always)]
    fn address(&self, leaf: u32) -> *const u8 {
        self.instances.as_ptr().wrapping_add(leaf as usize).cast()
    }
}
