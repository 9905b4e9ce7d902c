use crate::build::{Soup, build_top, build_tree, instance_bounds};
use crate::geometry::{BuildOptions, Geometry, Placement, Quality};
use crate::node::{Node8, STACK_CAPACITY, Tree};
use crate::ray::{Hit, Ray};
use crate::traverse::{Instance, Isa, Scene};
use kilauea_math::{Bounds3, DAffine3, DMat3, DVec3, Vec3};
use rayon::prelude::*;

/// Answers which triangle a ray meets.
///
/// Geometries placed once are baked into one tree in engine space; those placed more often get a
/// tree each, and a tree over their instances.
#[derive(Clone, Debug)]
pub struct Accel {
    isa: Isa,
    pub(crate) trees: Vec<Tree>,
    pub(crate) top: Option<Top>,
    bounds: Bounds3,
    n_rejected: usize,
}

/// The tree over instances.
#[derive(Clone, Debug)]
pub(crate) struct Top {
    pub(crate) nodes: Vec<Node8>,
    pub(crate) instances: Vec<Instance>,
    /// Instances out of range.
    n_rejected: usize,
}

impl Accel {
    /// Builds the trees over `placements` of `geometries`.
    ///
    /// Never fails: what no ray can hit, or not reliably, is left out and counted. These are
    /// triangles with a bad index, a coordinate that is not finite or beyond 1e13, or no area, and
    /// placements of no geometry or with a matrix that has no inverse, or stretches one direction
    /// more than 1e12 times as much as another.
    pub fn build(
        geometries: &[Geometry<'_>],
        placements: &[Placement],
        options: &BuildOptions,
    ) -> Self {
        let plan = Plan::new(geometries, placements);
        let mut soups: Vec<Soup> = plan
            .shared
            .par_iter()
            .map(|&geometry| Soup::from_geometry(&geometries[geometry]))
            .collect();
        let mut baked = Soup::default();
        for &placement in &plan.baked {
            let Placement {
                geometry,
                world_from_geometry,
            } = &placements[placement as usize];
            baked.add_baked(
                &geometries[*geometry as usize],
                placement,
                world_from_geometry,
            );
        }
        soups.push(baked);

        let mut n_rejected =
            plan.n_rejected + soups.iter().map(|soup| soup.n_rejected).sum::<usize>();
        let trees: Vec<Tree> = soups
            .into_par_iter()
            .map(|soup| build_tree(soup, options.quality))
            .collect();
        let top =
            (!plan.shared.is_empty()).then(|| Top::new(&plan, placements, &trees, options.quality));
        n_rejected += top.as_ref().map_or(0, |top| top.n_rejected);
        let bounds = match &top {
            Some(top) => top.nodes[0].bounds(),
            None => trees[0].nodes[0].bounds(),
        };
        Self {
            isa: Isa::detect(options.simd),
            trees,
            top,
            bounds,
            n_rejected,
        }
    }

    /// The nearest hit; of equally near ones that of the lowest instance, then triangle.
    ///
    /// A ray that holds a NaN, starts nowhere or has no direction hits nothing.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.intersect_filtered(ray, |_| true)
    }

    /// Whether anything is hit.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.occluded_filtered(ray, |_| true)
    }

    /// The nearest hit that `keep` accepts (cut-outs). `keep` must answer alike for equal hits; it
    /// is asked for some of the hits, in any order, and may be asked again for the same one.
    #[inline]
    pub fn intersect_filtered(&self, ray: &Ray, mut keep: impl FnMut(&Hit) -> bool) -> Option<Hit> {
        if !ray.is_valid() {
            return None;
        }
        if ray.has_extreme_dir() {
            return self.intersect_extreme(ray, &mut keep);
        }
        self.isa.closest(self.scene(), ray, keep)
    }

    /// Whether any hit is accepted by `keep`, which is asked as in [`Self::intersect_filtered`].
    #[inline]
    pub fn occluded_filtered(&self, ray: &Ray, mut keep: impl FnMut(&Hit) -> bool) -> bool {
        if !ray.is_valid() {
            return false;
        }
        if ray.has_extreme_dir() {
            return self.intersect_extreme(ray, &mut keep).is_some();
        }
        self.isa.occluded(self.scene(), ray, keep)
    }

    /// A box around everything that can be hit, larger than the tightest by a few ulps.
    pub fn bounds(&self) -> Bounds3 {
        self.bounds
    }

    /// Triangles and placements that the build left out.
    pub fn n_rejected(&self) -> usize {
        self.n_rejected
    }

    /// Memory of nodes, triangles and instances.
    pub fn n_bytes(&self) -> usize {
        let trees = self.trees.iter().map(Tree::n_bytes).sum::<usize>();
        let top = self
            .top
            .iter()
            .map(|top| size_of_val(top.nodes.as_slice()) + size_of_val(top.instances.as_slice()));
        trees + top.sum::<usize>()
    }

    #[inline(always)]
    fn scene(&self) -> Scene<'_> {
        match &self.top {
            None => Scene::Single(&self.trees[0]),
            Some(top) => Scene::TwoLevel {
                top: &top.nodes,
                instances: &top.instances,
                trees: &self.trees,
            },
        }
    }

    /// Traces with a direction scaled to a length that the tests can take.
    #[cold]
    fn intersect_extreme(&self, ray: &Ray, keep: &mut dyn FnMut(&Hit) -> bool) -> Option<Hit> {
        let (scaled, factor) = ray.with_moderate_dir();
        let rescale = |hit: &Hit| Hit {
            t: (f64::from(hit.t) * factor) as f32,
            ..*hit
        };
        let mut keep_rescaled = |hit: &Hit| {
            let hit = rescale(hit);
            hit.t > ray.t_min.max(0.0) && hit.t <= ray.t_max && keep(&hit)
        };
        let keep_rescaled: &mut dyn FnMut(&Hit) -> bool = &mut keep_rescaled;
        self.isa
            .closest(self.scene(), &scaled, keep_rescaled)
            .map(|hit| rescale(&hit))
    }
}

/// Which geometries are baked, which shared.
struct Plan {
    /// Placements whose geometry is placed nowhere else.
    baked: Vec<u32>,
    /// Placements of shared geometries, with the index of their tree.
    instanced: Vec<(u32, u32)>,
    /// Geometries that get a tree of their own.
    shared: Vec<usize>,
    n_rejected: usize,
}

impl Plan {
    fn new(geometries: &[Geometry<'_>], placements: &[Placement]) -> Self {
        let mut plan = Self {
            baked: Vec::new(),
            instanced: Vec::new(),
            shared: Vec::new(),
            n_rejected: 0,
        };
        let mut n_placed = vec![0_u32; geometries.len()];
        let is_valid = |placement: &Placement| {
            (placement.geometry as usize) < geometries.len()
                && has_inverse(&placement.world_from_geometry)
        };
        for placement in placements {
            if is_valid(placement) {
                n_placed[placement.geometry as usize] += 1;
            } else {
                plan.n_rejected += 1;
            }
        }
        let mut tree_of = vec![None; geometries.len()];
        for (index, placement) in placements.iter().enumerate() {
            if !is_valid(placement) {
                continue;
            }
            let geometry = placement.geometry as usize;
            if n_placed[geometry] == 1
                && keeps_shape(&geometries[geometry], &placement.world_from_geometry)
            {
                plan.baked.push(index as u32);
                continue;
            }
            let tree = *tree_of[geometry].get_or_insert_with(|| {
                plan.shared.push(geometry);
                plan.shared.len() as u32 - 1
            });
            plan.instanced.push((index as u32, tree));
        }
        plan
    }
}

/// Whether a ray can be taken into the geometry's space and keeps some digits there.
fn has_inverse(world_from_geometry: &DAffine3) -> bool {
    const MAX_STRETCH: f64 = 1e12;
    let matrix = world_from_geometry.matrix3;
    let inverse = matrix.inverse();
    let largest = |m: DMat3| {
        m.to_cols_array()
            .into_iter()
            .map(f64::abs)
            .fold(0.0, f64::max)
    };
    world_from_geometry.is_finite()
        && inverse.is_finite()
        && world_from_geometry.inverse().is_finite()
        && largest(matrix) * largest(inverse) <= MAX_STRETCH
}

/// Whether the geometry keeps 14 bits across its width when its positions are rounded in engine
/// space; further from the origin it is more accurate, if slower, as an instance.
fn keeps_shape(geometry: &Geometry<'_>, world_from_geometry: &DAffine3) -> bool {
    const MAX_DISTANCE_IN_WIDTHS: f64 = 1024.0;
    if *world_from_geometry == DAffine3::IDENTITY {
        return true;
    }
    let bounds = Bounds3::from_points(
        geometry
            .meshes
            .iter()
            .flat_map(|(positions, _)| positions.iter().copied().map(Vec3::from_array))
            .filter(|p| p.is_finite()),
    );
    if bounds.is_empty() {
        return true;
    }
    let center = world_from_geometry.transform_point3(bounds.center().as_dvec3());
    let half: DVec3 = 0.5 * bounds.diagonal().as_dvec3();
    let width = (world_from_geometry.matrix3 * half).length();
    center.abs().max_element() <= MAX_DISTANCE_IN_WIDTHS * width
}

impl Top {
    fn new(plan: &Plan, placements: &[Placement], trees: &[Tree], quality: Quality) -> Self {
        let baked_tree = trees.len() - 1;
        let ball_around = |tree: usize| {
            let bounds = trees[tree].nodes[0].bounds();
            let radius = 0.5 * bounds.diagonal().as_dvec3().length();
            (bounds.center().as_dvec3(), radius)
        };
        let (center, radius) = ball_around(baked_tree);
        let baked = Instance {
            tree: baked_tree as u32,
            id_base: 0,
            geometry_from_world: None,
            center,
            radius,
        };
        let placed = plan.instanced.iter().map(|&(index, tree)| {
            let world_from_geometry = placements[index as usize].world_from_geometry;
            let (center, radius) = ball_around(tree as usize);
            let instance = Instance {
                tree,
                id_base: index,
                geometry_from_world: Some(world_from_geometry.inverse()),
                center,
                radius,
            };
            (instance, world_from_geometry)
        });
        let mut top = Self {
            nodes: Vec::new(),
            instances: Vec::new(),
            n_rejected: 0,
        };
        let mut boxes = Vec::new();
        for (instance, world_from_geometry) in placed.chain([(baked, DAffine3::IDENTITY)]) {
            let tree = &trees[instance.tree as usize];
            if tree.n_triangles == 0 {
                continue;
            }
            if let Some(bounds) = instance_bounds(tree, &world_from_geometry) {
                boxes.push(bounds);
                top.instances.push(instance);
            } else {
                top.n_rejected += 1;
            }
        }
        top.nodes = build_top(&boxes, quality, STACK_CAPACITY);
        top
    }
}
