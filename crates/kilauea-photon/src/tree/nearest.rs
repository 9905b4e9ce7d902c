use std::collections::BinaryHeap;

use kilauea_math::Vec3;

use super::{PointTree, WIDTH, bound_sq};

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
        let by_distance = self.d_sq.total_cmp(&other.d_sq);
        by_distance.then(self.idx.cmp(&other.idx))
    }
}

impl PointTree {
    /// The `k` nearest of the points at most `max_radius` from `p` for which `accept(index, squared
    /// distance)` holds, nearest first.
    pub(crate) fn nearest(
        &self,
        p: Vec3,
        k: usize,
        max_radius: f32,
        accept: impl Fn(usize, f32) -> bool,
    ) -> Vec<Found> {
        let mut nearest = Nearest {
            k,
            bound_sq: bound_sq(max_radius),
            found: BinaryHeap::with_capacity(k.min(self.n_points)),
        };
        self.offer_near(p, &mut nearest, &accept);
        nearest.found.into_sorted_vec()
    }

    /// The nearest one.
    #[inline]
    pub(crate) fn nearest_one(
        &self,
        p: Vec3,
        max_radius: f32,
        accept: impl Fn(usize, f32) -> bool,
    ) -> Option<Found> {
        let mut nearest = NearestOne {
            bound_sq: bound_sq(max_radius),
            found: None,
        };
        self.offer_near(p, &mut nearest, &accept);
        nearest.found
    }

    /// Offers all points that could be among the nearest, roughly in ascending order.
    #[inline]
    fn offer_near<C: Candidates>(
        &self,
        p: Vec3,
        candidates: &mut C,
        accept: &impl Fn(usize, f32) -> bool,
    ) {
        if !self.blocks.is_empty() && p.is_finite() {
            self.offer_node(self.level_starts.len() - 1, 0, p, candidates, accept);
        }
    }

    fn offer_node<C: Candidates>(
        &self,
        level: usize,
        node_idx: usize,
        p: Vec3,
        candidates: &mut C,
        accept: &impl Fn(usize, f32) -> bool,
    ) {
        let d_sq = self.node(level, node_idx).distances_sq(p);
        for lane in lanes_by_distance(&d_sq) {
            // Children that are missing are infinitely far.
            if d_sq[lane] > candidates.bound_sq() || d_sq[lane] == f32::INFINITY {
                return;
            }
            let child = node_idx * WIDTH + lane;
            if level == 0 {
                self.offer_block(child, p, candidates, accept);
            } else {
                self.offer_node(level - 1, child, p, candidates, accept);
            }
        }
    }

    #[inline]
    fn offer_block<C: Candidates>(
        &self,
        block_idx: usize,
        p: Vec3,
        candidates: &mut C,
        accept: &impl Fn(usize, f32) -> bool,
    ) {
        let d_sq = self.blocks[block_idx].distances_sq(p);
        for (lane, &d_sq) in d_sq.iter().enumerate() {
            let idx = block_idx * WIDTH + lane;
            // False for the NaNs that fill the last block.
            if d_sq <= candidates.bound_sq() && accept(idx, d_sq) {
                candidates.keep(Found {
                    d_sq,
                    idx: idx as u32,
                });
            }
        }
    }
}

/// The nearest points so far.
trait Candidates {
    /// What is farther is none of the nearest.
    fn bound_sq(&self) -> f32;

    /// Takes a point within the bound, if it is one of the nearest.
    fn keep(&mut self, found: Found);
}

struct Nearest {
    k: usize,
    bound_sq: f32,
    /// The farthest on top.
    found: BinaryHeap<Found>,
}

impl Candidates for Nearest {
    #[inline]
    fn bound_sq(&self) -> f32 {
        self.bound_sq
    }

    fn keep(&mut self, found: Found) {
        if self.found.len() < self.k {
            self.found.push(found);
        } else if let Some(mut farthest) = self.found.peek_mut()
            && found < *farthest
        {
            *farthest = found;
        }
        if self.found.len() == self.k {
            self.bound_sq = self.found.peek().map_or(0.0, |farthest| farthest.d_sq);
        }
    }
}

struct NearestOne {
    bound_sq: f32,
    found: Option<Found>,
}

impl Candidates for NearestOne {
    #[inline]
    fn bound_sq(&self) -> f32 {
        self.bound_sq
    }

    #[inline]
    fn keep(&mut self, found: Found) {
        if self.found.is_none_or(|nearest| found < nearest) {
            self.bound_sq = found.d_sq;
            self.found = Some(found);
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
