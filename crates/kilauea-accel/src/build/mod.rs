//! From meshes to trees.

mod balanced;
mod binary;
mod binned;
mod blocks;
mod buckets;
mod pair;
mod parts;
mod plan;
mod soup;
mod top;
mod wide;

pub(crate) use plan::Plan;
pub(crate) use soup::{has_area, in_range};
pub(crate) use top::{build_top, instance_bounds};

use crate::geometry::Quality;
use crate::node::{EMPTY, LEAF, Node8, PairLeaf, STACK_CAPACITY, Tree};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use pair::Pair;
use rayon::prelude::*;
use soup::Soup;
use wide::{WideOptions, widen};

/// Stack entries kept for the tree over buckets; the rest is for the tree of one bucket.
const TOP_STACK: usize = 128;

/// Builds the tree over a soup of triangles.
pub(crate) fn build_tree(mut soup: Soup, quality: Quality) -> Tree {
    let n_triangles = soup.n_triangles;
    let mut trees: Vec<Tree> = buckets::cut(&mut soup.pairs)
        .into_par_iter()
        .map(|bucket| build_bucket(bucket, quality))
        .collect();
    drop(soup);
    let mut tree = if trees.len() == 1 {
        trees.remove(0)
    } else {
        join_buckets(trees, quality)
    };
    tree.n_triangles = n_triangles;
    tree
}

fn build_bucket(pairs: &[Pair], quality: Quality) -> Tree {
    let options = WideOptions {
        max_leaf_size: 4,
        leaf_cost: 1.0,
        primitive_cost: 0.0,
    };
    let boxes: Vec<Aabb> = pairs.iter().map(Pair::bounds_with_border).collect();
    let bvh = binary::over_boxes(&boxes, quality);
    let (nodes, groups) = bounded_widen(bvh, options, STACK_CAPACITY - TOP_STACK, || {
        balanced::over_boxes(&boxes)
    });
    let leaves = groups.iter().map(|group| pack_leaf(group, pairs));
    Tree {
        leaves: leaves.collect(),
        nodes,
        n_triangles: 0,
    }
}

/// Puts a tree over the trees of the buckets.
fn join_buckets(buckets: Vec<Tree>, quality: Quality) -> Tree {
    let boxes: Vec<Aabb> = buckets
        .iter()
        .map(|tree| {
            let bounds = tree.nodes[0].bounds();
            Aabb::new(bounds.min.into(), bounds.max.into())
        })
        .collect();
    let mut tree = Tree {
        nodes: build_top(&boxes, quality, TOP_STACK),
        leaves: Vec::with_capacity(buckets.iter().map(|b| b.leaves.len()).sum()),
        n_triangles: 0,
    };
    let mut roots = Vec::with_capacity(buckets.len());
    let mut n_nodes = tree.nodes.len();
    for bucket in &buckets {
        roots.push(n_nodes as u32);
        n_nodes += bucket.nodes.len();
    }
    // What the top tree calls a leaf is the root of a bucket.
    for link in tree.nodes.iter_mut().flat_map(|node| &mut node.child) {
        if *link != EMPTY {
            *link = match *link & LEAF {
                0 => *link,
                _ => roots[(*link & !LEAF) as usize],
            };
        }
    }
    tree.nodes.reserve_exact(n_nodes - tree.nodes.len());
    for mut bucket in buckets {
        let (first_node, first_leaf) = (tree.nodes.len() as u32, tree.leaves.len() as u32);
        for link in bucket.nodes.iter_mut().flat_map(|node| &mut node.child) {
            if *link != EMPTY {
                *link += if *link & LEAF == 0 {
                    first_node
                } else {
                    first_leaf
                };
            }
        }
        tree.nodes.append(&mut bucket.nodes);
        tree.leaves.append(&mut bucket.leaves);
    }
    tree
}

/// Widens `bvh`, or a balanced tree in the (never yet seen) case that `stack` entries would not
/// suffice to traverse it.
fn bounded_widen(
    bvh: Bvh2,
    options: WideOptions,
    stack: usize,
    balanced: impl FnOnce() -> Bvh2,
) -> (Vec<Node8>, Vec<Vec<u32>>) {
    let wide = widen(&bvh, options);
    if wide.stack_need <= stack {
        return (wide.nodes, wide.leaves);
    }
    drop(bvh);
    let wide = widen(&balanced(), options);
    (wide.nodes, wide.leaves)
}

fn pack_leaf(group: &[u32], pairs: &[Pair]) -> PairLeaf {
    let mut leaf = PairLeaf::NONE;
    for (lane, &i) in group.iter().enumerate() {
        pairs[i as usize].store(&mut leaf, lane);
    }
    leaf.error = rounding_error(group.iter().map(|&i| pairs[i as usize].longest_edge()));
    leaf
}

/// See [`PairLeaf::error`].
///
/// Let L be the longest edge, z the first corner's distance along the ray's largest axis and u the
/// rounding unit. Sheared corners are off by at most 7u (|z| + 3L) and, where the line passes
/// inside, no further than 2L from it. So each edge function is off by less than 70u L (|z| + 3L),
/// and their sum weighted with distances, which differ by at most L, by three times that and the
/// roundings of its own terms; 420u L² (|z| + 3L) has room for all.
fn rounding_error(longest_edges: impl Iterator<Item = f32>) -> [f32; 2] {
    const UNIT: f32 = f32::EPSILON * 0.5;
    let longest = longest_edges.fold(0.0, f32::max);
    [70.0 * UNIT * longest, longest]
}
