use crate::build::{Plan, build_top, instance_bounds};
use crate::forest::{Forest, Kind, PartTrees};
use crate::geometry::{BuildOptions, Geometry, Placement};
use crate::node::Node8;
use crate::ray::{Hit, Ray};
use crate::traverse::{Ball, Instance, Isa, Keep, KeepAll, Part, Scene, TreeRay};
use crate::visibility::Visibility;
use crate::whole::Whole;
use kilauea_math::{Bounds3, DAffine3};

/// Answers what a ray meets.
///
/// Still triangles of geometries placed once are baked into one tree in engine space. All else gets
/// trees of its own, apart by kind, motion and visibility so that no walk asks for what its tree
/// does not have, and a tree over their instances.
#[derive(Clone, Debug)]
pub struct Accel {
    isa: Isa,
    pub(crate) forest: Forest,
    pub(crate) top: Option<Top>,
    bounds: Bounds3,
    around_whole: Ball,
    n_rejected: usize,
}

/// The tree over instances.
#[derive(Clone, Debug)]
pub(crate) struct Top {
    pub(crate) nodes: Vec<Node8>,
    pub(crate) instances: Vec<Instance>,
    /// What each instance is made of; none where all are of still triangles that all rays see.
    pub(crate) parts: Option<Vec<Part>>,
    /// Instances out of range.
    n_rejected: usize,
}

impl Accel {
    /// Builds the trees over `placements` of `geometries`.
    ///
    /// Never fails: what no ray can hit, or not reliably, is left out and counted. These are
    /// primitives with a bad index, a coordinate that is not finite or beyond 1e13, a radius that
    /// is negative, not finite or zero (of a whole segment), triangles without area, and placements
    /// of no geometry or with a matrix that has no inverse, or stretches one direction more than
    /// 1e12 times as much as another. What no ray sees is left out too.
    pub fn build(
        geometries: &[Geometry<'_>],
        placements: &[Placement],
        options: &BuildOptions,
    ) -> Self {
        let whole = Whole::of(geometries, placements);
        Self::build_part(geometries, placements, &whole, options)
    }

    /// Builds the trees over a part of a scene: `geometries` in which meshes, spheres and curves are
    /// empty that are elsewhere. `placements` are all of them. Hits have the numbers and the bits
    /// that they have in the whole.
    pub fn build_part(
        geometries: &[Geometry<'_>],
        placements: &[Placement],
        whole: &Whole,
        options: &BuildOptions,
    ) -> Self {
        let Plan {
            forest,
            placed,
            mut n_rejected,
        } = Plan::new(geometries, placements, whole);
        let is_plain = |(part, placement): &(PartTrees, Option<u32>)| {
            let moves = placement.is_some_and(|i| placements[i as usize].keys().len() > 1);
            part.kind == Kind::Triangles && part.visibility == Visibility::ALL && !moves
        };
        let is_plain = options.specialize && placed.iter().all(is_plain);
        let is_single = is_plain && matches!(placed[..], [(_, None)]);
        let top = (!is_single).then(|| {
            let parts = TopParts {
                placed: &placed,
                placements,
                whole,
            };
            Top::new(&parts, &forest, is_plain)
        });
        n_rejected += top.as_ref().map_or(0, |top| top.n_rejected);
        let bounds = match &top {
            Some(top) => top.nodes[0].bounds(),
            None => forest.triangles[0].nodes[0].bounds(),
        };
        Self {
            isa: Isa::detect(options.simd),
            forest,
            top,
            bounds,
            around_whole: Ball::around(&whole.bounds()),
            n_rejected,
        }
    }

    /// The nearest hit; of equally near ones that of the lowest instance, then primitive.
    ///
    /// A ray that holds a NaN, starts nowhere or has no direction hits nothing.
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.intersect_kept::<false>(ray, KeepAll)
    }

    /// The same, in less time if rays are asked for in an order in which each goes much like the one
    /// before, as those of a camera do, and otherwise in more.
    pub fn intersect_coherent(&self, ray: &Ray) -> Option<Hit> {
        self.intersect_kept::<true>(ray, KeepAll)
    }

    /// Whether anything is hit.
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.occluded_kept(ray, KeepAll)
    }

    /// The nearest hit that `keep` accepts (cut-outs). `keep` must answer alike for equal hits; it
    /// is asked for some of the hits, in any order, and may be asked again for the same one.
    #[inline]
    pub fn intersect_filtered(&self, ray: &Ray, keep: impl FnMut(&Hit) -> bool) -> Option<Hit> {
        self.intersect_kept::<false>(ray, keep)
    }

    /// Whether any hit is accepted by `keep`, which is asked as in [`Self::intersect_filtered`].
    #[inline]
    pub fn occluded_filtered(&self, ray: &Ray, keep: impl FnMut(&Hit) -> bool) -> bool {
        self.occluded_kept(ray, keep)
    }

    #[inline(always)]
    fn intersect_kept<const COHERENT: bool>(&self, ray: &Ray, mut keep: impl Keep) -> Option<Hit> {
        if !ray.is_moderate() {
            return self.intersect_extreme(ray, &mut |hit| keep.keep(hit));
        }
        let tree_ray = || TreeRay::world(ray.line(), ray.t_min);
        self.isa
            .closest::<COHERENT, _>(self.scene(), (ray, tree_ray), keep)
    }

    #[inline(always)]
    fn occluded_kept(&self, ray: &Ray, mut keep: impl Keep) -> bool {
        if !ray.is_moderate() {
            return self
                .intersect_extreme(ray, &mut |hit| keep.keep(hit))
                .is_some();
        }
        let tree_ray = || TreeRay::world(ray.line(), ray.t_min);
        self.isa.occluded(self.scene(), (ray, tree_ray), keep)
    }

    /// A box around everything that can be hit, at any time, larger than the tightest by a few ulps.
    pub fn bounds(&self) -> Bounds3 {
        self.bounds
    }

    /// Primitives and placements that the build left out, but for those that no ray sees.
    pub fn n_rejected(&self) -> usize {
        self.n_rejected
    }

    /// Memory of nodes, primitives and instances.
    pub fn n_bytes(&self) -> usize {
        let top = self.top.as_ref().map_or(0, |top| {
            size_of_val(top.nodes.as_slice())
                + size_of_val(top.instances.as_slice())
                + top
                    .parts
                    .as_ref()
                    .map_or(0, |parts| size_of_val(parts.as_slice()))
        });
        self.forest.n_bytes() + top
    }

    #[inline(always)]
    fn scene(&self) -> Scene<'_> {
        match &self.top {
            None => Scene::Single(&self.forest.triangles[0]),
            Some(top) => match &top.parts {
                None => Scene::Instanced {
                    top: &top.nodes,
                    instances: &top.instances,
                    trees: &self.forest.triangles,
                },
                Some(parts) => Scene::General {
                    top: &top.nodes,
                    instances: &top.instances,
                    parts,
                    forest: &self.forest,
                },
            },
        }
    }

    /// Traces with a direction scaled to a length that the tests can take, from where the ray enters
    /// a ball around all, if it is a ray.
    #[cold]
    fn intersect_extreme(&self, ray: &Ray, keep: &mut dyn FnMut(&Hit) -> bool) -> Option<Hit> {
        if !ray.is_valid() {
            return None;
        }
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
        let tree_ray = || TreeRay::entering(&scaled, &self.around_whole);
        self.isa
            .closest::<false, _>(self.scene(), (&scaled, tree_ray), keep_rescaled)
            .map(|hit| rescale(&hit))
    }
}

/// Trees and where they stand.
struct TopParts<'a> {
    placed: &'a [(PartTrees, Option<u32>)],
    placements: &'a [Placement],
    whole: &'a Whole,
}

impl Top {
    fn new(of: &TopParts<'_>, forest: &Forest, is_plain: bool) -> Self {
        let placements = of.placements;
        let mut top = Self {
            nodes: Vec::new(),
            instances: Vec::new(),
            parts: None,
            n_rejected: 0,
        };
        let mut boxes = Vec::new();
        let mut parts = Vec::new();
        for (part, placement) in of.placed {
            let part_boxes = forest.boxes(part);
            if part_boxes.is_empty() {
                continue;
            }
            let placement_keys =
                placement.map_or(&[DAffine3::IDENTITY][..], |i| placements[i as usize].keys());
            let Some(bounds) = instance_bounds(&part_boxes, placement_keys) else {
                top.n_rejected += 1;
                continue;
            };
            boxes.push(bounds);
            // Of the whole geometry, as where rays start decides about what they graze.
            let around = placement.map_or(of.whole.bounds(), |i| {
                let geometry = placements[i as usize].geometry;
                of.whole.geometries[geometry as usize].bounds
            });
            let ball = Ball::around(&around);
            let is_in_world = placement_keys == [DAffine3::IDENTITY];
            top.instances.push(Instance {
                tree: part.first,
                id_base: placement.unwrap_or(0),
                geometry_from_world: (!is_in_world).then(|| placement_keys[0].inverse()),
                ball,
            });
            parts.push(Part {
                kind: part.kind,
                n_keys: part.n_keys,
                visibility: part.visibility,
                world_from_geometry: (placement_keys.len() > 1).then(|| placement_keys.into()),
            });
        }
        top.nodes = build_top(boxes);
        top.parts = (!is_plain).then_some(parts);
        top
    }
}
