//! Binary trees from the top down, every node cut where the surface area heuristic is least, judged
//! at bins of the boxes' centers (Wald 2007).

use kilauea_math::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;

/// Bins by axis.
pub(super) const N_BINS: usize = 32;
/// Below this depth nodes are halved, so that no input makes trees of any depth.
const MAX_DEPTH: u32 = 96;
/// From this many boxes on, the two halves are built side by side.
const MIN_PARALLEL: usize = 4096;

/// A box with its number, and twice its center.
#[derive(Clone, Copy)]
struct Item {
    bounds: Aabb,
    center: Vec3A,
    index: u32,
}

/// One box to a leaf.
pub(crate) fn over_boxes(boxes: impl ExactSizeIterator<Item = Aabb>) -> Bvh2 {
    let mut items: Vec<Item> = boxes
        .zip(0..)
        .map(|(bounds, index)| Item {
            bounds,
            center: bounds.min + bounds.max,
            index,
        })
        .collect();
    if items.is_empty() {
        return Bvh2::default();
    }
    let mut nodes = vec![Bvh2Node::default(); 2 * items.len() - 1];
    let (root, below) = nodes.split_at_mut(1);
    build(&mut root[0], below, 1, &mut items, 0, 0);
    Bvh2 {
        nodes,
        primitive_indices: items.iter().map(|item| item.index).collect(),
        ..Bvh2::default()
    }
}

/// Builds the tree over `items`, which begin at `first_item`, into `node` and the nodes `below` it,
/// which begin at `first_below`. The two children come first, then all below the one, then all
/// below the other: where each node goes is known beforehand.
fn build(
    node: &mut Bvh2Node,
    below: &mut [Bvh2Node],
    first_below: usize,
    items: &mut [Item],
    first_item: usize,
    depth: u32,
) {
    let bounds = items
        .iter()
        .fold(Aabb::INVALID, |all, item| all.union(&item.bounds));
    if items.len() == 1 {
        *node = Bvh2Node::new(bounds, 1, first_item as u32);
        return;
    }
    *node = Bvh2Node::new(bounds, 0, first_below as u32);
    let n_left = cut(items, depth);
    let n_below_left = 2 * (n_left - 1);
    let is_large = items.len() >= MIN_PARALLEL;
    let (left_items, right_items) = items.split_at_mut(n_left);
    let (children, below) = below.split_at_mut(2);
    let (left, right) = children.split_at_mut(1);
    let (below_left, below_right) = below.split_at_mut(n_below_left);
    let first_left = first_below + 2;
    let first_right = first_left + n_below_left;
    let mut build_left = || {
        build(
            &mut left[0],
            below_left,
            first_left,
            left_items,
            first_item,
            depth + 1,
        );
    };
    let mut build_right = || {
        build(
            &mut right[0],
            below_right,
            first_right,
            right_items,
            first_item + n_left,
            depth + 1,
        );
    };
    if is_large {
        rayon::join(build_left, build_right);
    } else {
        build_left();
        build_right();
    }
}

/// Moves the items of the first child to the front and returns how many these are.
fn cut(items: &mut [Item], depth: u32) -> usize {
    let half = items.len() / 2;
    let (min, max) = items.iter().fold(
        (Vec3A::INFINITY, Vec3A::NEG_INFINITY),
        |(min, max), item| (min.min(item.center), max.max(item.center)),
    );
    if items.len() == 2 || depth >= MAX_DEPTH {
        return half;
    }
    // Few items need few bins. The factor keeps the last center within the last bin.
    let n_bins = N_BINS.min(4 + half);
    let bins_per_length = Vec3A::splat(n_bins as f32 * (1.0 - 1e-4)) / (max - min);
    let bin_of = |item: &Item| (item.center - min) * bins_per_length;

    let mut bins = [[(Aabb::INVALID, 0_u32); N_BINS]; 3];
    for item in items.iter() {
        let at = bin_of(item);
        for axis in 0..3 {
            let (bounds, n) = &mut bins[axis][(at[axis] as usize).min(n_bins - 1)];
            *bounds = bounds.union(&item.bounds);
            *n += 1;
        }
    }
    let best = (0..3)
        .filter(|&axis| max[axis] > min[axis])
        .filter_map(|axis| best_bin(&bins[axis][..n_bins]).map(|(cost, bin)| (cost, axis, bin)))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, axis, bin)) = best else {
        return half;
    };
    partition(items, |item| {
        (bin_of(item)[axis] as usize).min(n_bins - 1) < bin
    })
}

/// The first bin of the second child where that is cheapest, and the cost; none if all items are in
/// one bin.
pub(super) fn best_bin(bins: &[(Aabb, u32)]) -> Option<(f32, usize)> {
    let mut right_cost = [0.0; N_BINS];
    let mut right = (Aabb::INVALID, 0);
    for bin in (1..bins.len()).rev() {
        right = (right.0.union(&bins[bin].0), right.1 + bins[bin].1);
        right_cost[bin] = cost(right);
    }
    let mut left = (Aabb::INVALID, 0);
    let mut best = None;
    for bin in 1..bins.len() {
        left = (left.0.union(&bins[bin - 1].0), left.1 + bins[bin - 1].1);
        let sum = cost(left) + right_cost[bin];
        if sum.is_finite() && best.is_none_or(|(least, _)| sum < least) {
            best = Some((sum, bin));
        }
    }
    best
}

fn cost((bounds, n): (Aabb, u32)) -> f32 {
    if n == 0 {
        f32::INFINITY
    } else {
        bounds.half_area() * n as f32
    }
}

/// Moves what `is_left` accepts to the front; returns how many that are.
pub(super) fn partition<T>(items: &mut [T], is_left: impl Fn(&T) -> bool) -> usize {
    let (mut left, mut right) = (0, items.len());
    while left < right {
        if is_left(&items[left]) {
            left += 1;
        } else {
            right -= 1;
            items.swap(left, right);
        }
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxes(n: usize, place: impl Fn(usize) -> f32) -> Vec<Aabb> {
        (0..n)
            .map(|i| {
                let low = Vec3A::new(place(i), (i % 7) as f32, 0.0);
                Aabb::new(low, low + 1.0)
            })
            .collect()
    }

    fn check(boxes: &[Aabb]) -> Bvh2 {
        let bvh = over_boxes(boxes.iter().copied());
        let mut seen = vec![0; boxes.len()];
        let mut open = vec![(0, 0)];
        while let Some((index, depth)) = open.pop() {
            let node = &bvh.nodes[index];
            assert!(depth < 2 * MAX_DEPTH);
            if node.is_leaf() {
                let item = bvh.primitive_indices[node.first_index as usize] as usize;
                seen[item] += 1;
                assert_eq!(node.aabb().min, boxes[item].min);
                continue;
            }
            let first = node.first_index as usize;
            let both = bvh.nodes[first].aabb().union(bvh.nodes[first + 1].aabb());
            assert_eq!((both.min, both.max), (node.aabb().min, node.aabb().max));
            open.extend([(first, depth + 1), (first + 1, depth + 1)]);
        }
        assert!(seen.iter().all(|&n| n == 1));
        bvh
    }

    #[test]
    fn every_box_is_in_one_leaf() {
        for n in [1, 2, 3, 10, 5000] {
            check(&boxes(n, |i| (i * 37 % 101) as f32));
        }
    }

    #[test]
    fn equal_boxes_and_geometric_series_stay_shallow() {
        check(&boxes(3000, |_| 0.0));
        check(&boxes(3000, |i| 1.02_f32.powi(i as i32)));
    }

    #[test]
    fn what_is_apart_is_cut_apart() {
        let bvh = check(&boxes(64, |i| if i % 2 == 0 { 0.0 } else { 1e3 }));
        assert!(bvh.nodes[1].aabb().max.x < 2.0);
        assert!(bvh.nodes[2].aabb().min.x > 9e2);
    }
}
