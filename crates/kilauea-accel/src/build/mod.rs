//! From meshes to trees.

mod balanced;
mod binary;
mod soup;
mod top;
mod wide;

pub(crate) use soup::Soup;
pub(crate) use top::{build_top, instance_bounds};

use crate::geometry::Quality;
use crate::node::{Leaf4, Node8, STACK_CAPACITY, Tree};
use obvhs::bvh2::Bvh2;
use soup::SoupTriangle;
use wide::{WideOptions, widen};

/// Builds the tree over a soup of triangles.
pub(crate) fn build_tree(soup: &Soup, quality: Quality) -> Tree {
    let options = WideOptions {
        max_leaf_size: 4,
        leaf_cost: 1.0,
    };
    let bvh = binary::over_triangles(&soup.triangles, quality);
    let (nodes, groups) = bounded_widen(bvh, options, || {
        balanced::over_boxes(
            &soup
                .triangles
                .iter()
                .map(SoupTriangle::bounds)
                .collect::<Vec<_>>(),
        )
    });
    let leaves = groups
        .iter()
        .map(|group| pack_leaf(group, &soup.triangles))
        .collect();
    Tree {
        nodes,
        leaves,
        n_triangles: soup.triangles.len(),
    }
}

/// Widens `bvh`, or a balanced tree in the (never yet seen) case that the traversal stack would
/// not suffice for it.
fn bounded_widen(
    bvh: Bvh2,
    options: WideOptions,
    balanced: impl FnOnce() -> Bvh2,
) -> (Vec<Node8>, Vec<Vec<u32>>) {
    let wide = widen(&bvh, options);
    if wide.stack_need <= STACK_CAPACITY {
        return (wide.nodes, wide.leaves);
    }
    drop(bvh);
    let wide = widen(&balanced(), options);
    (wide.nodes, wide.leaves)
}

fn pack_leaf(group: &[u32], triangles: &[SoupTriangle]) -> Leaf4 {
    let mut leaf = Leaf4::NONE;
    for (lane, &i) in group.iter().enumerate() {
        let triangle = &triangles[i as usize];
        for vertex in 0..3 {
            for axis in 0..3 {
                leaf.v[vertex][axis][lane] = triangle.v[vertex][axis];
            }
        }
        leaf.triangle[lane] = triangle.triangle;
        leaf.instance[lane] = triangle.instance;
    }
    leaf.error = distance_error(group.iter().map(|&i| triangles[i as usize].longest_edge()));
    leaf
}

/// See [`Leaf4::error`].
///
/// Let L be the longest edge, z the first corner's distance along the ray's largest axis and u the
/// rounding unit. Sheared corners are off by at most 7u (|z| + 3L) and, where the line passes
/// inside, no further than 2L from it. So each edge function is off by less than 70u L (|z| + 3L),
/// and their sum weighted with distances, which differ by at most L, by three times that and the
/// roundings of its own terms; 400u L² (|z| + 3L) has room for all.
fn distance_error(longest_edges: impl Iterator<Item = f32>) -> [f32; 2] {
    const UNIT: f32 = f32::EPSILON * 0.5;
    // Products of tiny triangles lose digits below this: never call their distance certain.
    const UNDERFLOW: f32 = 1e-34;
    let longest = longest_edges.fold(0.0, f32::max);
    let per_distance = 400.0 * UNIT * longest * longest;
    [per_distance, 3.0 * longest * per_distance + UNDERFLOW]
}
