//! The order of points in a tree: halves by the middle of the longer side, as in a kd-tree.

use std::cmp::Ordering;

use kilauea_math::{Bounds3, Vec3};
use rayon::prelude::*;

use super::WIDTH;

/// Points below which a half is one task.
const POINTS_PER_TASK: usize = 8192;

/// A point and which one it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub(super) p: Vec3,
    pub(super) idx: u32,
}

/// Orders points so that all runs that make a block or the children of a node lie close together:
/// those at 8 i .. 8 (i + 1), at 64 i .. 64 (i + 1), and so on.
///
/// Each range is split across the longest side of its box. The lower half gets as many points as the
/// largest subtree with no gap can hold, so only the last block of all is not full. Points with
/// equal coordinates are told apart by `key`, so that the order does not depend on how they came.
pub(super) fn order_by_halves(entries: &mut [Entry], key: &(impl Fn(u32) -> u64 + Sync)) {
    if entries.len() <= WIDTH {
        entries.sort_unstable_by_key(|entry| key(entry.idx));
        return;
    }
    let axis = longest_axis(entries);
    let n_lower = entries.len().next_power_of_two() / 2;
    entries.select_nth_unstable_by(n_lower, |a, b| along(axis, a, b, key));

    let (lower, upper) = entries.split_at_mut(n_lower);
    if lower.len() < POINTS_PER_TASK {
        order_by_halves(lower, key);
        order_by_halves(upper, key);
    } else {
        rayon::join(
            || order_by_halves(lower, key),
            || order_by_halves(upper, key),
        );
    }
}

#[inline]
fn along(axis: usize, a: &Entry, b: &Entry, key: &impl Fn(u32) -> u64) -> Ordering {
    let by_place = a.p[axis].total_cmp(&b.p[axis]);
    by_place.then_with(|| key(a.idx).cmp(&key(b.idx)))
}

fn longest_axis(entries: &[Entry]) -> usize {
    let bounds_of = |part: &[Entry]| Bounds3::from_points(part.iter().map(|entry| entry.p));
    let bounds = if entries.len() < POINTS_PER_TASK {
        bounds_of(entries)
    } else {
        entries
            .par_chunks(POINTS_PER_TASK)
            .map(bounds_of)
            .reduce(|| Bounds3::EMPTY, |a, b| a.union(&b))
    };
    bounds.diagonal().max_position()
}
