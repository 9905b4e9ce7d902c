//! Which nodes of a binary tree become nodes of eight, at the least expected cost (Ylitie et al.
//! 2017, section 4.1).

use obvhs::bvh2::Bvh2;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// What a leaf may hold and cost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LeafOptions {
    /// Most primitives to a leaf: at most four.
    pub(crate) max_size: u32,
    /// Cost of a leaf block, however full, in node visits.
    pub(crate) cost: f32,
    /// Further cost of each primitive in a leaf.
    pub(crate) primitive_cost: f32,
}

/// From here on up, both children of a node are looked at side by side.
const MIN_PARALLEL: usize = 4096;
/// And no further than this below the root.
const MAX_PARALLEL_DEPTH: u32 = 10;
/// Bits of a choice for a number of roots.
const BITS: usize = 3;
/// The bit of a choice that makes a leaf.
const IS_LEAF: u32 = 1 << 31;

/// The cheapest way to collapse every subtree.
pub(super) struct Choices {
    /// By binary node: the roots that its first child gets of 2 to 8, zero where one root fewer is
    /// as good, and [`IS_LEAF`].
    choices: Vec<AtomicU32>,
    /// Of the binary tree.
    pub(super) depth: u32,
}

/// Costs of a subtree.
#[derive(Clone, Copy)]
struct Subtree {
    /// With at most `i + 1` roots.
    costs: [f32; 7],
    n_primitives: u32,
    depth: u32,
}

impl Choices {
    /// Chooses for a tree that has a root.
    pub(super) fn new(bvh: &Bvh2, options: LeafOptions) -> Self {
        let mut choices = Self {
            choices: (bvh.nodes.par_iter().with_min_len(MIN_PARALLEL))
                .map(|_| AtomicU32::new(0))
                .collect(),
            depth: 0,
        };
        let parallel_depth = if bvh.nodes.len() < MIN_PARALLEL {
            0
        } else {
            MAX_PARALLEL_DEPTH
        };
        choices.depth = choices.choose(bvh, &options, 0, parallel_depth).depth;
        choices
    }

    /// Chooses for all nodes from `index` on down.
    fn choose(
        &self,
        bvh: &Bvh2,
        options: &LeafOptions,
        index: usize,
        parallel_depth: u32,
    ) -> Subtree {
        let node = &bvh.nodes[index];
        let area = node.aabb().half_area();
        let leaf_cost = |n: u32| area * (options.cost + n as f32 * options.primitive_cost);
        if node.is_leaf() {
            self.choices[index].store(IS_LEAF, Relaxed);
            return Subtree {
                costs: [leaf_cost(1); 7],
                n_primitives: 1,
                depth: 0,
            };
        }
        let first = node.first_index as usize;
        let child = |i| self.choose(bvh, options, first + i, parallel_depth.saturating_sub(1));
        let (left, right) = if parallel_depth > 0 {
            rayon::join(|| child(0), || child(1))
        } else {
            (child(0), child(1))
        };
        let n_primitives = left.n_primitives + right.n_primitives;
        let (below, n_left) = best_split(&left, &right, 8.min(n_primitives));
        let mut choice = if n_primitives >= 8 {
            n_left << (6 * BITS)
        } else {
            0
        };
        let (as_leaf, as_node) = (leaf_cost(n_primitives), area + below);
        let is_leaf = n_primitives <= options.max_size && as_leaf <= as_node;
        if is_leaf {
            choice |= IS_LEAF;
        }
        let mut costs = [if is_leaf { as_leaf } else { as_node }; 7];
        // More roots than primitives are of no use.
        for n_roots in 2..=7.min(n_primitives as usize) {
            let (cost, n_left) = best_split(&left, &right, n_roots as u32);
            if cost < costs[n_roots - 2] {
                choice |= n_left << ((n_roots - 2) * BITS);
                costs[n_roots - 1..].fill(cost);
            }
        }
        self.choices[index].store(choice, Relaxed);
        Subtree {
            costs,
            n_primitives,
            depth: 1 + left.depth.max(right.depth),
        }
    }

    /// Whether a node is a leaf, with all below it.
    pub(super) fn is_leaf(&self, index: u32) -> bool {
        self.choices[index as usize].load(Relaxed) & IS_LEAF != 0
    }

    /// Calls `add` with the nodes that become children of `index`: at most eight.
    pub(super) fn for_each_child(&self, bvh: &Bvh2, index: u32, add: &mut impl FnMut(u32)) {
        self.for_each_root(bvh, index, 8, add);
    }

    /// Calls `add` with the roots, at most `n_roots`, that stand for `index`.
    fn for_each_root(&self, bvh: &Bvh2, index: u32, mut n_roots: u32, add: &mut impl FnMut(u32)) {
        let choice = self.choices[index as usize].load(Relaxed);
        let n_left = |n_roots: u32| choice >> ((n_roots as usize - 2) * BITS) & 7;
        while n_roots > 1 && n_left(n_roots) == 0 {
            n_roots -= 1;
        }
        if n_roots == 1 {
            return add(index);
        }
        let n_left = n_left(n_roots);
        let first = bvh.nodes[index as usize].first_index;
        self.for_each_root(bvh, first, n_left, add);
        self.for_each_root(bvh, first + 1, n_roots - n_left, add);
    }
}

/// The least cost of two subtrees that share `n_roots` roots, and how many the first has then.
fn best_split(left: &Subtree, right: &Subtree, n_roots: u32) -> (f32, u32) {
    let first = 1.max(n_roots.saturating_sub(right.n_primitives.min(7)));
    let last = left.n_primitives.min(7).min(n_roots - 1);
    let mut best = (f32::INFINITY, first);
    for n_left in first..=last {
        let cost = left.costs[n_left as usize - 1] + right.costs[(n_roots - n_left) as usize - 1];
        if cost < best.0 {
            best = (cost, n_left);
        }
    }
    best
}
