use std::collections::BinaryHeap;

use kilauea_math::Vec3;

use super::{PointTree, WIDTH};

/// A point that was found, ordered by distance, then by index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Squared distance.
    pub d_sq: f32,
    /// Index in the map.
    pub idx: u32,
}

impl Eq for Found {}

impl PartialOrd for Found {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Found {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.d_sq
            .total_cmp(&other.d_sq)
            .then(self.idx.cmp(&other.idx))
    }
}

impl PointTree {
    /// The `k` nearest of the points at most `max_radius` from `p` that `accept` takes, nearest
    /// first.
    pub(crate) fn nearest(
        &self,
        p: Vec3,
        k: usize,
        max_radius: f32,
        accept: impl Fn(usize) -> bool,
    ) -> Vec<Found> {
        let mut search = Search {
            tree: self,
            p,
            k,
            bound_sq: max_radius * max_radius,
            accept,
            found: BinaryHeap::with_capacity(k.min(self.n_points) + 1),
        };
        if k > 0 && !self.nodes.is_empty() {
            search.visit(self.level_starts.len() - 1, 0);
        }
        search.found.into_sorted_vec()
    }
}

struct Search<'t, Accept> {
    tree: &'t PointTree,
    p: Vec3,
    k: usize,
    /// What is farther is not among the nearest.
    bound_sq: f32,
    accept: Accept,
    /// The farthest on top.
    found: BinaryHeap<Found>,
}

impl<Accept: Fn(usize) -> bool> Search<'_, Accept> {
    /// Looks into the children of a node, the nearest first.
    fn visit(&mut self, level: usize, node_idx: usize) {
        let d_sq = self.tree.node(level, node_idx).distances_sq(self.p);
        for lane in lanes_by_distance(&d_sq) {
            if d_sq[lane] > self.bound_sq || d_sq[lane] == f32::INFINITY {
                return;
            }
            let child = node_idx * WIDTH + lane;
            if level == 0 {
                self.visit_block(child);
            } else {
                self.visit(level - 1, child);
            }
        }
    }

    fn visit_block(&mut self, block_idx: usize) {
        let d_sq = self.tree.blocks[block_idx].distances_sq(self.p);
        for (lane, &d_sq) in d_sq.iter().enumerate() {
            let idx = block_idx * WIDTH + lane;
            // False for the NaNs that fill the last block.
            if d_sq <= self.bound_sq && (self.accept)(idx) {
                self.keep(Found {
                    d_sq,
                    idx: idx as u32,
                });
            }
        }
    }

    fn keep(&mut self, found: Found) {
        self.found.push(found);
        if self.found.len() > self.k {
            self.found.pop();
        }
        if self.found.len() == self.k {
            self.bound_sq = self.found.peek().map_or(0.0, |farthest| farthest.d_sq);
        }
    }
}

/// Lane numbers in ascending order of their distances, by counting how many come before each.
fn lanes_by_distance(d_sq: &[f32; WIDTH]) -> [usize; WIDTH] {
    let mut lanes = [0; WIDTH];
    for lane in 0..WIDTH {
        let before =
            |other: usize| d_sq[other] < d_sq[lane] || (d_sq[other] == d_sq[lane] && other < lane);
        let rank = (0..WIDTH).filter(|&other| before(other)).count();
        lanes[rank] = lane;
    }
    lanes
}
