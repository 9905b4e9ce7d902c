//! What the children of every wide node are, before any box is written.

use super::collapse::Choices;
use crate::node::LEAF;
use obvhs::bvh2::Bvh2;
use rayon::prelude::*;
use std::collections::VecDeque;

/// A wide node: its children in either tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    binary: [u32; 8],
    child: [u32; 8],
    len: usize,
}

/// The wide nodes of a tree or subtree, the root first, and the binary nodes that become its leaves.
#[derive(Debug)]
pub(super) struct Outlines {
    pub(super) nodes: Vec<Outline>,
    pub(super) leaves: Vec<u32>,
}

/// A binary node that becomes a wide one, and the number of that.
type Open = (u32, usize);

/// The walk from the root ends at so many subtrees, which are walked side by side.
const N_SUBTREES: usize = 256;

impl Outlines {
    /// Of a tree, alike for any number of threads.
    pub(super) fn new(bvh: &Bvh2, choices: &Choices) -> Self {
        let mut all = Self::with_root();
        let mut open = VecDeque::from([(0, 0)]);
        while open.len() < N_SUBTREES
            && let Some(next) = open.pop_front()
        {
            all.add_children(bvh, choices, next, |child| open.push_back(child));
        }
        let subtrees: Vec<Self> = open
            .par_iter()
            .map(|&(root, _)| Self::below(bvh, choices, root))
            .collect();
        for ((_, node), subtree) in open.into_iter().zip(subtrees) {
            all.graft(node, subtree);
        }
        all
    }

    fn with_root() -> Self {
        Self {
            nodes: vec![Outline::EMPTY],
            leaves: Vec::new(),
        }
    }

    /// Of the subtree below a binary node.
    fn below(bvh: &Bvh2, choices: &Choices, root: u32) -> Self {
        let mut subtree = Self::with_root();
        let mut open = vec![(root, 0)];
        while let Some(next) = open.pop() {
            subtree.add_children(bvh, choices, next, |child| open.push(child));
        }
        subtree
    }

    /// Finds the children of a node and calls `open` with those that have children themselves.
    fn add_children(
        &mut self,
        bvh: &Bvh2,
        choices: &Choices,
        (binary, node): Open,
        mut open: impl FnMut(Open),
    ) {
        let mut outline = Outline::of(bvh, choices, binary);
        for lane in 0..outline.len {
            let root = outline.binary[lane];
            outline.child[lane] = if choices.is_leaf(root) {
                self.leaves.push(root);
                (self.leaves.len() - 1) as u32 | LEAF
            } else {
                self.nodes.push(Outline::EMPTY);
                let index = self.nodes.len() - 1;
                open((root, index));
                index as u32
            };
        }
        self.nodes[node] = outline;
    }

    /// Puts a subtree in place of a node, and what is below it behind all that is there.
    fn graft(&mut self, node: usize, subtree: Self) {
        // The root of the subtree is not among those behind.
        let first_node = self.nodes.len() as u32 - 1;
        let first_leaf = self.leaves.len() as u32;
        let moved = |mut outline: Outline| {
            for child in &mut outline.child[..outline.len] {
                *child += if *child & LEAF == 0 {
                    first_node
                } else {
                    first_leaf
                };
            }
            outline
        };
        let mut outlines = subtree.nodes.into_iter().map(moved);
        self.nodes[node] = outlines.next().unwrap_or(Outline::EMPTY);
        self.nodes.extend(outlines);
        self.leaves.extend(subtree.leaves);
    }
}

impl Outline {
    const EMPTY: Self = Self {
        binary: [0; 8],
        child: [0; 8],
        len: 0,
    };

    /// The children of a binary node that becomes a wide one, or is a leaf and the root.
    fn of(bvh: &Bvh2, choices: &Choices, binary: u32) -> Self {
        let mut outline = Self::EMPTY;
        let mut add = |root: u32| {
            outline.binary[outline.len] = root;
            outline.len += 1;
        };
        if choices.is_leaf(binary) {
            add(binary);
        } else {
            choices.for_each_child(bvh, binary, &mut add);
            outline.order_for_any_hit(bvh, choices);
        }
        outline
    }

    /// Puts the children in the order in which a walk for any hit should try them, from the last on:
    /// leaves, which can end it at once, then nodes, and large ones before small.
    fn order_for_any_hit(&mut self, bvh: &Bvh2, choices: &Choices) {
        let area = |root: u32| bvh.nodes[root as usize].aabb().half_area();
        self.binary[..self.len].sort_unstable_by(|&a, &b| {
            let leaves_last = choices.is_leaf(a).cmp(&choices.is_leaf(b));
            let large_last = area(a).total_cmp(&area(b));
            leaves_last.then(large_last).then(a.cmp(&b))
        });
    }

    /// By lane: the binary node and the link.
    pub(super) fn children(&self) -> impl Iterator<Item = (u32, u32)> {
        self.binary.into_iter().zip(self.child).take(self.len)
    }
}
