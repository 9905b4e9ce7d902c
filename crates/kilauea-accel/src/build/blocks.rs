//! Trees over primitives other than still triangles.

use super::collapse::LeafOptions;
use super::parts::{CurvePart, Part};
use super::reference::references;
use super::soup::SoupTriangle;
use super::wide::{Group, WideTree};
use super::{PAIRS, pack_leaf, pair::Pair};
use crate::block::{
    Block, BlockTree, CurveBlock, CurveStore, MovingCurveBlock, MovingPairs, MovingSphereBlock,
    SphereBlock, StoredSegment,
};
use crate::node::WalkNode;
use crate::primitive::{Piece, Segment, Sphere};
use kilauea_math::Bounds3;
use obvhs::aabb::Aabb;
use rayon::prelude::*;

/// Puts a tree over items by their boxes at both ends of an interval; `block` makes a leaf.
fn build<B: Block + Send>(
    boxes: &[[Bounds3; 2]],
    options: LeafOptions,
    (store, n_primitives): (B::Store, usize),
    block: impl Fn(&B::Store, &Group) -> B + Send + Sync,
) -> BlockTree<B> {
    let swept = boxes.iter().map(|[first, last]| {
        let bounds = first.union(last);
        Aabb::new(bounds.min.into(), bounds.max.into())
    });
    let WideTree { nodes, leaves } = WideTree::over(references(swept), options);
    let leaf_boxes = |leaf: usize| {
        [0, 1].map(|end| {
            let items = leaves[leaf].items();
            items.fold(Bounds3::EMPTY, |all, i| all.union(&boxes[i][end]))
        })
    };
    BlockTree {
        bounds: nodes[0].bounds(),
        nodes: B::Node::over(nodes, leaf_boxes),
        leaves: leaves
            .par_iter()
            .map(|group| block(&store, group))
            .collect(),
        store,
        n_primitives,
    }
}

const SPHERES: LeafOptions = LeafOptions {
    max_size: 4,
    cost: 1.0,
    primitive_cost: 0.0,
};

pub(crate) fn over_spheres(part: &Part<Sphere>) -> BlockTree<SphereBlock> {
    let spheres = &part.keys[0];
    let boxes: Vec<_> = spheres.iter().map(|s| [s.bounds(); 2]).collect();
    build(&boxes, SPHERES, ((), spheres.len()), |(), group| {
        SphereBlock::new(group.items().map(|i| (spheres[i], part.ids[i])))
    })
}

/// The tree between motion keys `key` and `key + 1`.
pub(crate) fn over_moving_spheres(part: &Part<Sphere>, key: usize) -> BlockTree<MovingSphereBlock> {
    let ends = [&part.keys[key], &part.keys[key + 1]];
    let n = part.ids.len();
    let boxes: Vec<_> = (0..n)
        .map(|i| ends.map(|spheres| spheres[i].bounds()))
        .collect();
    build(&boxes, SPHERES, ((), n), |(), group| MovingSphereBlock {
        ends: ends
            .map(|spheres| SphereBlock::new(group.items().map(|i| (spheres[i], part.ids[i])))),
    })
}

/// The tree between motion keys `key` and `key + 1`.
pub(crate) fn over_moving_triangles(
    part: &Part<[[f32; 3]; 3]>,
    key: usize,
) -> BlockTree<MovingPairs> {
    let pairs = moving_pairs(part, key);
    let boxes: Vec<_> = pairs
        .iter()
        .map(|ends| {
            ends.map(|pair| {
                let bounds = pair.bounds_with_border();
                Bounds3 {
                    min: bounds.min.into(),
                    max: bounds.max.into(),
                }
            })
        })
        .collect();
    build(&boxes, PAIRS, ((), part.ids.len()), |(), group| {
        let mut ends = [0, 1].map(|end| pack_leaf(group.items().map(|i| pairs[i][end])));
        // The bound grows with the longest edge, which is never longer than at one of the ends.
        let error = [0, 1].map(|i| ends[0].error[i].max(ends[1].error[i]));
        for leaf in &mut ends {
            leaf.error = error;
        }
        MovingPairs { ends }
    })
}

/// Neighbours that share an edge at both ends of the interval, in pairs, and the others alone.
fn moving_pairs(part: &Part<[[f32; 3]; 3]>, key: usize) -> Vec<[Pair; 2]> {
    let triangle = |i: usize| {
        [key, key + 1].map(|key| SoupTriangle {
            v: part.keys[key][i],
            triangle: part.ids[i],
            instance: 0,
        })
    };
    let mut pairs = Vec::with_capacity(part.ids.len());
    let mut i = 0;
    while i < part.ids.len() {
        let first = triangle(i);
        let joined = (i + 1 < part.ids.len())
            .then(|| triangle(i + 1))
            .and_then(|second| Pair::joined_alike(&first, &second));
        i += if joined.is_some() { 2 } else { 1 };
        pairs.push(joined.unwrap_or_else(|| [0, 1].map(|end| Pair::single(&first[end]))));
    }
    pairs
}

/// A piece of a curve costs about as much as the nodes above it together.
const CURVES: LeafOptions = LeafOptions {
    max_size: 4,
    cost: 1.0,
    primitive_cost: 4.0,
};

pub(crate) fn over_curves(part: &CurvePart) -> BlockTree<CurveBlock> {
    let (pieces, store) = pieces(part, 0, &[]);
    let boxes = boxes(&pieces, &store);
    build(&boxes, CURVES, (store, part.ids.len()), |store, group| {
        let pieces: Vec<_> = group.items().map(|i| pieces[i]).collect();
        CurveBlock::new(store, &pieces)
    })
}

/// The tree between motion keys `key` and `key + 1`.
pub(crate) fn over_moving_curves(part: &CurvePart, key: usize) -> BlockTree<MovingCurveBlock> {
    let (pieces, store) = pieces(part, key, &part.keys[key + 1]);
    let boxes = boxes(&pieces, &store);
    build(&boxes, CURVES, (store, part.ids.len()), |store, group| {
        let pieces: Vec<_> = group.items().map(|i| pieces[i]).collect();
        MovingCurveBlock::new(store, &pieces)
    })
}

/// Boxes around pieces at both ends of the interval.
fn boxes(pieces: &[(u32, Piece)], store: &CurveStore) -> Vec<[Bounds3; 2]> {
    let pieces = pieces.par_iter();
    pieces.map(|&(i, piece)| store.bounds(i, piece)).collect()
}

/// The pieces of all segments as they are cut at `key`.
fn pieces(part: &CurvePart, key: usize, later: &[Segment]) -> (Vec<(u32, Piece)>, CurveStore) {
    let segments = &part.keys[key];
    let pieces = segments
        .par_iter()
        .enumerate()
        .flat_map_iter(|(i, segment)| segment.pieces().into_iter().map(move |p| (i as u32, p)))
        .collect();
    let stored = segments.iter().zip(&part.ids).zip(&part.normals_of);
    let store = CurveStore {
        segments: stored
            .map(|((&segment, &primitive), &normals)| StoredSegment {
                segment,
                primitive,
                normals,
            })
            .collect(),
        later: later.to_vec(),
        normals: part.normals.clone(),
    };
    (pieces, store)
}
