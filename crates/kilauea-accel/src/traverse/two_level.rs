//! Queries: leaves of triangles, and instances above them.

use super::kernel::Kernel;
use super::tree_ray::TreeRay;
use super::triangle;
use super::walk::{Visitor, any_order, near_first};
use crate::node::{Node8, Tree};
use crate::ray::{Hit, Ray};
use kilauea_math::{DAffine3, DVec3};

/// What a walk goes through.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Scene<'a> {
    /// TreeLeaves in engine space.
    Single(&'a Tree),
    /// A tree whose leaves are instances.
    TwoLevel {
        top: &'a [Node8],
        instances: &'a [Instance],
        trees: &'a [Tree],
    },
}

/// A tree put into engine space.
#[derive(Clone, Debug)]
pub(crate) struct Instance {
    pub(crate) tree: u32,
    /// What hits report; added to that of the triangles.
    pub(crate) id_base: u32,
    /// `None` where the tree is in engine space.
    pub(crate) geometry_from_world: Option<DAffine3>,
    /// Middle of the tree's box, in its own space.
    pub(crate) center: DVec3,
    /// Half the diagonal of that box.
    pub(crate) radius: f64,
}

impl Instance {
    /// The ray in the tree's space, moved to where it enters a ball around the tree.
    ///
    /// The ball is that of the tree's own space: the instance's box in engine space can be larger
    /// than the tree by the ratio of its scales, and rounded at the distance of the ray's origin.
    #[inline(always)]
    fn tree_ray(&self, ray: &Ray, world_ray: &TreeRay) -> TreeRay {
        let Some(transform) = &self.geometry_from_world else {
            return *world_ray;
        };
        let origin = transform.transform_point3(ray.origin.as_dvec3());
        let dir = transform.transform_vector3(ray.dir.as_dvec3());
        let t_middle = (self.center - origin).dot(dir) / dir.length_squared();
        let t_start = t_middle - self.radius / dir.abs().max_element();
        TreeRay::moved(origin, dir, ray.t_min, t_start.max(0.0))
    }
}

/// The first hit in the order of [`Hit::wins_over`] that `keep` accepts.
#[inline(always)]
pub(crate) fn closest<K: Kernel>(
    kernel: K,
    scene: Scene<'_>,
    ray: &Ray,
    keep: impl FnMut(&Hit) -> bool,
) -> Option<Hit> {
    let mut search = Search::new(ray, keep);
    let world_ray = TreeRay::world(ray);
    match scene {
        Scene::Single(tree) => closest_in_tree(kernel, tree, &world_ray, 0, &mut search),
        Scene::TwoLevel {
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
            near_first(kernel, top, &kernel.node_ray(&world_ray), &mut visitor);
        }
    }
    (search.best.triangle != u32::MAX).then_some(search.best)
}

/// Whether `keep` accepts any hit.
#[inline(always)]
pub(crate) fn occluded<K: Kernel>(
    kernel: K,
    scene: Scene<'_>,
    ray: &Ray,
    keep: impl FnMut(&Hit) -> bool,
) -> bool {
    let mut search = Search::new(ray, keep);
    let world_ray = TreeRay::world(ray);
    match scene {
        Scene::Single(tree) => any_in_tree(kernel, tree, &world_ray, 0, &mut search),
        Scene::TwoLevel {
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
            any_order(kernel, top, &kernel.node_ray(&world_ray), &mut visitor)
        }
    }
}

/// The best hit so far; before any, one that every hit in range wins over.
struct Search<F> {
    t_min: f32,
    best: Hit,
    keep: F,
}

impl<F: FnMut(&Hit) -> bool> Search<F> {
    #[inline(always)]
    fn new(ray: &Ray, keep: F) -> Self {
        Self {
            t_min: ray.t_min.max(0.0),
            best: Hit {
                t: ray.t_max,
                u: 0.0,
                v: 0.0,
                triangle: u32::MAX,
                instance: u32::MAX,
            },
            keep,
        }
    }

    /// Takes the hit if it wins.
    #[inline(always)]
    fn offer(&mut self, hit: Hit) -> bool {
        let better = hit.t > self.t_min && hit.wins_over(&self.best) && (self.keep)(&hit);
        if better {
            self.best = hit;
        }
        better
    }
}

/// Leaves of triangles.
struct TreeLeaves<'a, K: Kernel, F, const ANY: bool> {
    kernel: K,
    tree: &'a Tree,
    ray: &'a TreeRay,
    leaf_ray: K::LeafRay,
    id_base: u32,
    limit: f32,
    search: &'a mut Search<F>,
}

impl<K: Kernel, F: FnMut(&Hit) -> bool, const ANY: bool> Visitor for TreeLeaves<'_, K, F, ANY> {
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.limit
    }

    #[inline(always)]
    fn visit(&mut self, leaf: u32) -> bool {
        let leaf = self.kernel.item(&self.tree.leaves, leaf);
        let mut candidates = self.kernel.candidates(&self.leaf_ray, self.limit, leaf);
        while candidates != 0 {
            let lane = (candidates.trailing_zeros() & 3) as usize;
            candidates &= candidates - 1;
            if let Some(place) = triangle::intersect(leaf, lane, self.ray)
                && self.search.offer(leaf.hit(lane, place, self.id_base))
            {
                if ANY {
                    return true;
                }
                self.limit = self.ray.limit(self.search.best.t);
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
fn closest_in_tree<K: Kernel>(
    kernel: K,
    tree: &Tree,
    ray: &TreeRay,
    id_base: u32,
    search: &mut Search<impl FnMut(&Hit) -> bool>,
) {
    let mut visitor = TreeLeaves::<_, _, false> {
        kernel,
        tree,
        ray,
        leaf_ray: kernel.leaf_ray(ray),
        id_base,
        limit: ray.limit(search.best.t),
        search,
    };
    near_first(kernel, &tree.nodes, &kernel.node_ray(ray), &mut visitor);
}

#[inline(always)]
fn any_in_tree<K: Kernel>(
    kernel: K,
    tree: &Tree,
    ray: &TreeRay,
    id_base: u32,
    search: &mut Search<impl FnMut(&Hit) -> bool>,
) -> bool {
    let mut visitor = TreeLeaves::<_, _, true> {
        kernel,
        tree,
        ray,
        leaf_ray: kernel.leaf_ray(ray),
        id_base,
        limit: ray.limit(search.best.t),
        search,
    };
    any_order(kernel, &tree.nodes, &kernel.node_ray(ray), &mut visitor)
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

impl<K: Kernel, F: FnMut(&Hit) -> bool, const ANY: bool> Visitor for TopLeaves<'_, K, F, ANY> {
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
