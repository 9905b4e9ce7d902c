//! From meshes to trees.

mod binned;
mod bins;
mod blocks;
mod collapse;
mod huge_pages;
mod outline;
mod pair;
mod parts;
mod plan;
mod reference;
mod refine;
mod soup;
mod top;
mod wide;

pub(crate) use plan::{Plan, has_inverse};
pub(crate) use soup::{has_area, in_range};
pub(crate) use top::{build_top, instance_bounds};

use crate::node::{PairLeaf, Tree};
use collapse::LeafOptions;
use pair::Pair;
use rayon::prelude::*;
use reference::reference;
use soup::{Pairing, Soup};
use wide::WideTree;

/// A leaf costs what a node costs, however full it is.
const PAIRS: LeafOptions = LeafOptions {
    max_size: 4,
    cost: 1.0,
    primitive_cost: 0.0,
};

/// Builds the tree over a soup of triangles; also says how many were left out.
pub(crate) fn build_tree(soup: &Soup<'_>) -> (Tree, usize) {
    let Pairing {
        pairs,
        n_triangles,
        n_rejected,
    } = soup.pairing();
    let references = pairs.par_iter().enumerate();
    let references = references
        .map(|(index, id)| reference(soup.pair(id).bounds_with_border(), index as u32))
        .collect();
    let wide = WideTree::over(references, PAIRS);
    let leaves = wide.leaves.par_iter();
    let leaves = leaves.map(|group| pack_leaf(group.items().map(|i| soup.pair(&pairs[i]))));
    let tree = Tree {
        leaves: huge_pages::collected(leaves),
        nodes: wide.nodes,
        n_triangles,
    };
    (tree, n_rejected)
}

/// At most four pairs.
fn pack_leaf(pairs: impl Iterator<Item = Pair>) -> PairLeaf {
    let mut leaf = PairLeaf::NONE;
    let mut longest = 0.0;
    for (lane, pair) in pairs.enumerate() {
        pair.store(&mut leaf, lane);
        longest = f32::max(longest, pair.longest_edge());
    }
    leaf.error = rounding_error(longest);
    leaf
}

/// See [`PairLeaf::error`].
///
/// Let L be the longest edge, z the first corner's distance along the ray's largest axis and u the
/// rounding unit. Sheared corners are off by at most 7u (|z| + 3L) and, where the line passes
/// inside, no further than 2L from it. So each edge function is off by less than 70u L (|z| + 3L),
/// and their sum weighted with distances, which differ by at most L, by three times that and the
/// roundings of its own terms; 420u L² (|z| + 3L) has room for all.
fn rounding_error(longest: f32) -> [f32; 2] {
    const UNIT: f32 = f32::EPSILON * 0.5;
    [70.0 * UNIT * longest, longest]
}
