//! Trees over primitives other than still triangles.

use super::parts::{CurvePart, Part};
use super::soup::SoupTriangle;
use super::wide::WideOptions;
use super::{balanced, binary, bounded_widen, pack_leaf, pair::Pair};
use crate::block::{
    Block, BlockTree, CurveBlock, CurveStore, MovingCurveBlock, MovingPairs, MovingSphereBlock,
    SphereBlock, StoredSegment,
};
use crate::geometry::Quality;
use crate::node::{STACK_CAPACITY, WalkNode};
use crate::primitive::{Piece, Segment, Sphere};
use kilauea_math::Bounds3;
use obvhs::aabb::Aabb;

/// Most items whose tree is improved node by node: that runs on one core, out of caches, and takes
/// minutes for millions.
const MAX_REFINED: usize = 1 << 18;

/// Puts a tree over items by their boxes at both ends of an interval; `block` makes a leaf of at
/// most `options.max_leaf_size` items.
fn build<B: Block>(
    boxes: &[[Bounds3; 2]],
    options: WideOptions,
    quality: Quality,
    (store, n_primitives): (B::Store, usize),
    block: impl Fn(&[u32]) -> B,
) -> BlockTree<B> {
    let swept: Vec<Aabb> = boxes
        .iter()
        .map(|[first, last]| {
            let bounds = first.union(last);
            Aabb::new(bounds.min.into(), bounds.max.into())
        })
        .collect();
    let quality = if swept.len() > MAX_REFINED {
        Quality::Preview
    } else {
        quality
    };
    let bvh = binary::over_boxes(&swept, quality);
    let (nodes, groups) = bounded_widen(bvh, options, STACK_CAPACITY, || {
        balanced::over_boxes(&swept)
    });
    let leaf_boxes = |leaf: usize| {
        [0, 1].map(|end| {
            groups[leaf].iter().fold(Bounds3::EMPTY, |bounds, &i| {
                bounds.union(&boxes[i as usize][end])
            })
        })
    };
    BlockTree {
        bounds: nodes[0].bounds(),
        nodes: B::Node::over(nodes, leaf_boxes),
        leaves: groups.iter().map(|group| block(group)).collect(),
        store,
        n_primitives,
    }
}

const SPHERES: WideOptions = WideOptions {
    max_leaf_size: 4,
    leaf_cost: 1.0,
    primitive_cost: 0.0,
};

pub(crate) fn over_spheres(part: &Part<Sphere>, quality: Quality) -> BlockTree<SphereBlock> {
    let spheres = &part.keys[0];
    let boxes: Vec<_> = spheres.iter().map(|s| [s.bounds(); 2]).collect();
    build(&boxes, SPHERES, quality, ((), spheres.len()), |group| {
        SphereBlock::new(
            group
                .iter()
                .map(|&i| (spheres[i as usize], part.ids[i as usize])),
        )
    })
}

/// The tree between motion keys `key` and `key + 1`.
pub(crate) fn over_moving_spheres(
    part: &Part<Sphere>,
    key: usize,
    quality: Quality,
) -> BlockTree<MovingSphereBlock> {
    let ends = [&part.keys[key], &part.keys[key + 1]];
    let n = part.ids.len();
    let boxes: Vec<_> = (0..n)
        .map(|i| ends.map(|spheres| spheres[i].bounds()))
        .collect();
    build(&boxes, SPHERES, quality, ((), n), |group| {
        MovingSphereBlock {
            ends: ends.map(|spheres| {
                SphereBlock::new(
                    group
                        .iter()
                        .map(|&i| (spheres[i as usize], part.ids[i as usize])),
                )
            }),
        }
    })
}

/// The tree between motion keys `key` and `key + 1`.
pub(crate) fn over_moving_triangles(
    part: &Part<[[f32; 3]; 3]>,
    key: usize,
    quality: Quality,
) -> BlockTree<MovingPairs> {
    let pairs = moving_pairs(part, key);
    let options = WideOptions {
        max_leaf_size: 4,
        leaf_cost: 1.0,
        primitive_cost: 0.0,
    };
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
    build(&boxes, options, quality, ((), part.ids.len()), |group| {
        let mut ends = [0, 1].map(|end| {
            let pairs: Vec<Pair> = group.iter().map(|&i| pairs[i as usize][end]).collect();
            let all: Vec<u32> = (0..pairs.len() as u32).collect();
            pack_leaf(&all, &pairs)
        });
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
const CURVES: WideOptions = WideOptions {
    max_leaf_size: 4,
    leaf_cost: 1.0,
    primitive_cost: 4.0,
};

pub(crate) fn over_curves(part: &CurvePart, quality: Quality) -> BlockTree<CurveBlock> {
    let (pieces, store) = pieces(part, 0, &[]);
    let boxes: Vec<_> = pieces
        .iter()
        .map(|&(i, piece)| store.bounds(i, piece))
        .collect();
    build(&boxes, CURVES, quality, (store, part.ids.len()), |group| {
        CurveBlock::new(group.iter().map(|&i| pieces[i as usize]))
    })
}

/// The tree between motion keys `key` and `key + 1`.
pub(crate) fn over_moving_curves(
    part: &CurvePart,
    key: usize,
    quality: Quality,
) -> BlockTree<MovingCurveBlock> {
    let (pieces, store) = pieces(part, key, &part.keys[key + 1]);
    let boxes: Vec<_> = pieces
        .iter()
        .map(|&(i, piece)| store.bounds(i, piece))
        .collect();
    build(&boxes, CURVES, quality, (store, part.ids.len()), |group| {
        MovingCurveBlock(CurveBlock::new(group.iter().map(|&i| pieces[i as usize])))
    })
}

/// The pieces of all segments as they are cut at `key`.
fn pieces(part: &CurvePart, key: usize, later: &[Segment]) -> (Vec<(u32, Piece)>, CurveStore) {
    let segments = &part.keys[key];
    let pieces = segments
        .iter()
        .enumerate()
        .flat_map(|(i, segment)| {
            segment
                .pieces()
                .into_iter()
                .map(move |piece| (i as u32, piece))
        })
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
