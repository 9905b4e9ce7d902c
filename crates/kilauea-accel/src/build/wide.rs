//! Trees of nodes with eight children.

use super::binned::{self, MAX_DEPTH};
use super::collapse::{Choices, LeafOptions};
use super::huge_pages;
use super::outline::{Outline, Outlines};
use super::reference::Reference;
use super::refine::refine;
use crate::node::{Node8, STACK_CAPACITY};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use rayon::prelude::*;

// Every wide node leaves up to seven entries on the stack, and the last all its children.
const _: () = assert!(7 * (MAX_DEPTH as usize) + 8 <= STACK_CAPACITY);

/// A tree whose leaves are lists of items; node 0 is the root and always exists.
#[derive(Clone, Debug)]
pub(crate) struct WideTree {
    pub(crate) nodes: Vec<Node8>,
    pub(crate) leaves: Vec<Group>,
}

/// The items of a leaf, in order: up to four.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Group {
    items: [u32; 4],
    len: u32,
}

/// Nodes or leaves that are written in one go, at least.
const MIN_JOB: usize = 256;

impl WideTree {
    /// Builds the tree that costs least to traverse, by the surface area heuristic.
    pub(crate) fn over(references: Vec<Reference>, options: LeafOptions) -> Self {
        if references.is_empty() {
            return Self {
                nodes: vec![Node8::NONE],
                leaves: Vec::new(),
            };
        }
        let mut bvh = binned::over(references);
        refine(&mut bvh);
        let choices = Choices::new(&bvh, options);
        if choices.depth <= MAX_DEPTH {
            return Self::collapsed(&bvh, &choices);
        }
        // What refining deepens too much, which was never seen, stays as it was cut.
        let mut leaves = bvh.nodes;
        leaves.retain(Reference::is_leaf);
        let bvh = binned::over(leaves);
        let choices = Choices::new(&bvh, options);
        Self::collapsed(&bvh, &choices)
    }

    fn collapsed(bvh: &Bvh2, choices: &Choices) -> Self {
        let outlines = Outlines::new(bvh, choices);
        let root = bvh.nodes[0].aabb();
        let scale = root.min.abs().max(root.max.abs()).max_element();
        let leaves = outlines.leaves.par_iter().with_min_len(MIN_JOB);
        Self {
            nodes: huge_pages::collected(
                (outlines.nodes.par_iter().with_min_len(MIN_JOB))
                    .map(|outline| wide_node(bvh, outline, scale)),
            ),
            leaves: leaves.map(|&root| Group::below(bvh, root)).collect(),
        }
    }
}

/// The boxes and links of a wide node.
fn wide_node(bvh: &Bvh2, outline: &Outline, scale: f32) -> Node8 {
    let mut node = Node8::NONE;
    for (lane, (binary, link)) in outline.children().enumerate() {
        set_lane_bounds(&mut node, lane, bvh.nodes[binary as usize].aabb(), scale);
        node.child[lane] = link;
    }
    node
}

impl Group {
    /// The items of a binary subtree.
    fn below(bvh: &Bvh2, root: u32) -> Self {
        let mut group = Self {
            items: [0; 4],
            len: 0,
        };
        group.collect(bvh, root);
        group.items[..group.len as usize].sort_unstable();
        group
    }

    fn collect(&mut self, bvh: &Bvh2, index: u32) {
        let node = &bvh.nodes[index as usize];
        if node.is_leaf() {
            self.items[self.len as usize] = node.first_index;
            self.len += 1;
        } else {
            self.collect(bvh, node.first_index);
            self.collect(bvh, node.first_index + 1);
        }
    }

    pub(crate) fn items(&self) -> impl Iterator<Item = usize> + Clone {
        let items = self.items.into_iter().take(self.len as usize);
        items.map(|item| item as usize)
    }
}

/// Writes a box a little enlarged, so that a ray within one of its faces is inside: the slab test
/// of a direction component near zero has no other slack.
fn set_lane_bounds(node: &mut Node8, lane: usize, bounds: &Aabb, scale: f32) {
    const ULP: f32 = f32::EPSILON;
    const LEAST: f32 = 1.0 / (1_u64 << 40) as f32;
    for axis in 0..3 {
        let (low, high) = (bounds.min[axis], bounds.max[axis]);
        let least = scale * LEAST;
        node.planes[2 * axis][lane] = low - (low.abs() * ULP + least);
        node.planes[2 * axis + 1][lane] = high + (high.abs() * ULP + least);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::PAIRS;
    use crate::build::reference::references;
    use crate::node::{EMPTY, LEAF};
    use kilauea_math::Vec3A;
    use kilauea_math::hash::{combine, unit_f32};
    use rayon::ThreadPoolBuilder;

    fn random_boxes(n: u32) -> Vec<Reference> {
        references((0..n).map(|i| {
            let number = |dimension| unit_f32(combine(i, dimension));
            let low = Vec3A::new(number(0), number(1), number(2));
            Aabb::new(low, low + 0.1 * number(3).powi(8))
        }))
    }

    fn built_on(n_threads: usize, n_boxes: u32) -> WideTree {
        let pool = ThreadPoolBuilder::new().num_threads(n_threads).build();
        let pool = pool.expect("threads");
        pool.install(|| WideTree::over(random_boxes(n_boxes), PAIRS))
    }

    #[test]
    fn any_number_of_threads_builds_the_same_tree() {
        let [one, three] = [1, 3].map(|n_threads| built_on(n_threads, 50_000));
        let links = |tree: &WideTree| -> Vec<_> { tree.nodes.iter().map(|n| n.child).collect() };
        let planes = |tree: &WideTree| -> Vec<_> { tree.nodes.iter().map(|n| n.planes).collect() };
        let items = |tree: &WideTree| -> Vec<Vec<usize>> {
            tree.leaves
                .iter()
                .map(|leaf| leaf.items().collect())
                .collect()
        };
        assert_eq!(links(&one), links(&three));
        assert_eq!(planes(&one), planes(&three));
        assert_eq!(items(&one), items(&three));
    }

    #[test]
    fn every_item_is_in_one_leaf_and_every_leaf_below_one_node() {
        for n in [1, 2, 5, 9, 1000, 20_000] {
            let tree = WideTree::over(random_boxes(n), PAIRS);
            let mut items: Vec<usize> = tree.leaves.iter().flat_map(Group::items).collect();
            items.sort_unstable();
            assert!(items.into_iter().eq(0..n as usize));
            let links = tree.nodes.iter().flat_map(|node| node.child);
            let mut links: Vec<u32> = links.filter(|&link| link != EMPTY).collect();
            links.sort_unstable();
            let leaves = (0..tree.leaves.len() as u32).map(|leaf| leaf | LEAF);
            let all = (1..tree.nodes.len() as u32).chain(leaves);
            assert!(links.into_iter().eq(all), "each has one parent");
        }
    }
}
