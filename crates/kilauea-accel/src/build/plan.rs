//! What becomes of geometries and placements: baked into a common tree, or a tree of its own and
//! instances.

use super::parts::Sorted;
use super::{Soup, blocks, build_tree};
use crate::block::{Block, BlockTree};
use crate::forest::{Forest, Kind, PartTrees};
use crate::geometry::{Geometry, Placement};
use crate::visibility::Visibility;
use crate::whole::{Numbered, Whole};
use kilauea_math::{DAffine3, DMat3};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// The trees of a scene and where they stand.
pub(crate) struct Plan {
    pub(crate) forest: Forest,
    /// Trees with the placement that they belong to; none for what is baked.
    pub(crate) placed: Vec<(PartTrees, Option<u32>)>,
    /// Primitives and placements left out.
    pub(crate) n_rejected: usize,
}

impl Plan {
    /// Of a part of `whole`.
    pub(crate) fn new(
        geometries: &[Geometry<'_>],
        placements: &[Placement],
        whole: &Whole,
    ) -> Self {
        let is_valid = |placement: &Placement| {
            (placement.geometry as usize) < geometries.len()
                && placement.keys().iter().all(has_inverse)
        };
        let (valid, invalid): (Vec<_>, Vec<_>) =
            (0_u32..).zip(placements).partition(|(_, p)| is_valid(p));
        let mut n_rejected = invalid.len();
        let mut n_placed = vec![0_u32; geometries.len()];
        for (_, placement) in &valid {
            n_placed[placement.geometry as usize] += 1;
        }
        let numbered = |geometry: usize| Numbered {
            geometry: &geometries[geometry],
            first_ids: &whole.geometries[geometry].first_ids,
        };

        let mut baked: BTreeMap<Visibility, Soup<'_>> = BTreeMap::new();
        let mut instanced = BTreeSet::new();
        for (index, placement) in &valid {
            let geometry = numbered(placement.geometry as usize);
            if !whole.is_baked(*index) {
                instanced.insert(placement.geometry);
                continue;
            }
            for visibility in still_visibilities(geometry.geometry) {
                let soup = baked.entry(visibility & placement.visibility).or_default();
                let place = &placement.world_from_geometry;
                soup.add_baked((geometry, visibility), *index, place);
            }
        }
        let built: Vec<BuiltGeometry> = n_placed
            .par_iter()
            .enumerate()
            .map(|(index, &n_placed)| match n_placed {
                0 => BuiltGeometry::default(),
                _ => BuiltGeometry::new(numbered(index), instanced.contains(&(index as u32))),
            })
            .collect();

        let mut forest = Forest::default();
        let mut placed = Vec::new();
        let mut parts_of = Vec::with_capacity(built.len());
        for geometry in built {
            n_rejected += geometry.n_rejected;
            let parts = geometry.trees.into_iter();
            parts_of.push(
                parts
                    .map(|(trees, visibility)| trees.plant(&mut forest, visibility))
                    .collect::<Vec<_>>(),
            );
        }
        for (index, placement) in &valid {
            for part in &parts_of[placement.geometry as usize] {
                let visibility = part.visibility & placement.visibility;
                placed.push((
                    PartTrees {
                        visibility,
                        ..*part
                    },
                    Some(*index),
                ));
            }
        }
        for (visibility, soup) in baked {
            let (tree, n_left_out) = build_tree(&soup);
            n_rejected += n_left_out;
            placed.push((Trees::Triangles(tree).plant(&mut forest, visibility), None));
        }
        placed.retain(|(part, _)| part.visibility != Visibility::NONE);
        Self {
            forest,
            placed,
            n_rejected,
        }
    }
}

/// Trees of one part, by interval between motion keys.
enum Trees {
    Triangles(crate::node::Tree),
    MovingTriangles(Vec<BlockTree<crate::block::MovingPairs>>),
    Spheres(Vec<BlockTree<crate::block::SphereBlock>>),
    MovingSpheres(Vec<BlockTree<crate::block::MovingSphereBlock>>),
    Curves(Vec<BlockTree<crate::block::CurveBlock>>),
    MovingCurves(Vec<BlockTree<crate::block::MovingCurveBlock>>),
}

impl Trees {
    /// Moves the trees into the forest.
    fn plant(self, forest: &mut Forest, visibility: Visibility) -> PartTrees {
        fn append<B: Block>(all: &mut Vec<BlockTree<B>>, new: Vec<BlockTree<B>>) -> (u32, usize) {
            let first = all.len() as u32;
            let n = new.len();
            all.extend(new);
            (first, n)
        }
        let (kind, (first, n)) = match self {
            Self::Triangles(tree) => {
                forest.triangles.push(tree);
                (Kind::Triangles, (forest.triangles.len() as u32 - 1, 0))
            }
            Self::MovingTriangles(trees) => {
                let at = append(&mut forest.moving_triangles, trees);
                (Kind::MovingTriangles, at)
            }
            Self::Spheres(trees) => (Kind::Spheres, append(&mut forest.spheres, trees)),
            Self::MovingSpheres(trees) => (
                Kind::MovingSpheres,
                append(&mut forest.moving_spheres, trees),
            ),
            Self::Curves(trees) => (Kind::Curves, append(&mut forest.curves, trees)),
            Self::MovingCurves(trees) => {
                (Kind::MovingCurves, append(&mut forest.moving_curves, trees))
            }
        };
        PartTrees {
            kind,
            first,
            n_keys: n as u32 + 1,
            visibility,
        }
    }
}

/// The trees of one geometry, in its own space.
#[derive(Default)]
struct BuiltGeometry {
    trees: Vec<(Trees, Visibility)>,
    n_rejected: usize,
}

impl BuiltGeometry {
    /// Leaves still triangles out unless `is_instanced`.
    fn new(geometry: Numbered<'_, '_>, is_instanced: bool) -> Self {
        let sorted = Sorted::new(geometry);
        let mut built = Self {
            trees: Vec::new(),
            n_rejected: sorted.n_rejected,
        };
        if is_instanced {
            for visibility in still_visibilities(geometry.geometry) {
                let (tree, n_rejected) = build_tree(&Soup::from_geometry(geometry, visibility));
                built.n_rejected += n_rejected;
                if tree.n_triangles > 0 {
                    built.add(Trees::Triangles(tree), visibility);
                }
            }
        }
        for ((n_keys, visibility), part) in &sorted.moving_triangles {
            if !part.ids.is_empty() {
                let trees = (0..n_keys - 1).map(|key| blocks::over_moving_triangles(part, key));
                built.add(Trees::MovingTriangles(trees.collect()), *visibility);
            }
        }
        for ((n_keys, visibility), part) in &sorted.spheres {
            let trees = match n_keys {
                _ if part.ids.is_empty() => continue,
                1 => Trees::Spheres(vec![blocks::over_spheres(part)]),
                _ => Trees::MovingSpheres(
                    (0..n_keys - 1)
                        .map(|key| blocks::over_moving_spheres(part, key))
                        .collect(),
                ),
            };
            built.add(trees, *visibility);
        }
        for ((n_keys, visibility), part) in &sorted.curves {
            let trees = match n_keys {
                _ if part.ids.is_empty() => continue,
                1 => Trees::Curves(vec![blocks::over_curves(part)]),
                _ => Trees::MovingCurves(
                    (0..n_keys - 1)
                        .map(|key| blocks::over_moving_curves(part, key))
                        .collect(),
                ),
            };
            built.add(trees, *visibility);
        }
        built
    }

    fn add(&mut self, trees: Trees, visibility: Visibility) {
        self.trees.push((trees, visibility));
    }
}

/// The visibilities that meshes which stand still have.
fn still_visibilities(geometry: &Geometry<'_>) -> BTreeSet<Visibility> {
    geometry
        .meshes
        .iter()
        .filter(|mesh| mesh.positions.len() <= 1)
        .map(|mesh| mesh.visibility)
        .filter(|&visibility| visibility != Visibility::NONE)
        .collect()
}

/// Whether a ray can be taken into the geometry's space and keeps some digits there.
pub(crate) fn has_inverse(world_from_geometry: &DAffine3) -> bool {
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
