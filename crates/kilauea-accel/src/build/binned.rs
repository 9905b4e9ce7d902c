//! Binary trees from the top down, every node cut where the surface area heuristic is least.

use super::bins::{Binning, Bins};
use super::reference::{Centers, Reference, doubled_center_at};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use rayon::prelude::*;

/// No leaf is deeper. Nodes are halved from where cuts in the worst place would lead further, so
/// that no input makes trees of any depth.
pub(crate) const MAX_DEPTH: u32 = 72;
/// Up to so many references are cut in the middle: they mostly share a leaf.
const MAX_MIDDLE: usize = 4;
/// From this many references on, the two children are built side by side.
const MIN_PARALLEL: usize = 4096;
/// From this many on, the references of one node are looked at side by side, so many at a time.
const CHUNK: usize = 1 << 14;

/// One reference to a leaf, at most [`MAX_DEPTH`] deep; there must be a reference.
pub(crate) fn over(mut references: Vec<Reference>) -> Bvh2 {
    // Zeros that are not touched here but where they are overwritten, on all cores.
    let mut nodes: Vec<Bvh2Node> = bytemuck::zeroed_vec(2 * references.len() - 1);
    let (root, below) = nodes.split_at_mut(1);
    let bounds = bounds_of(&references);
    let place = Place {
        node: &mut root[0],
        below,
        first_below: 1,
    };
    build(place, bounds, &mut references, 0, &mut Bins::new());
    Bvh2 {
        nodes,
        ..Bvh2::default()
    }
}

/// Where a subtree goes: its root, and all nodes below it, which begin at `first_below`.
struct Place<'a> {
    node: &'a mut Bvh2Node,
    below: &'a mut [Bvh2Node],
    first_below: usize,
}

impl<'a> Place<'a> {
    /// The places of two children, the first with `n_left` leaves: both roots come first, then all
    /// below the one, then all below the other.
    fn split(below: &'a mut [Bvh2Node], first_below: usize, n_left: usize) -> [Self; 2] {
        let n_below_left = 2 * (n_left - 1);
        let (roots, below) = below.split_at_mut(2);
        let (left, right) = roots.split_at_mut(1);
        let (below_left, below_right) = below.split_at_mut(n_below_left);
        let first_left = first_below + 2;
        [
            Self {
                node: &mut left[0],
                below: below_left,
                first_below: first_left,
            },
            Self {
                node: &mut right[0],
                below: below_right,
                first_below: first_left + n_below_left,
            },
        ]
    }
}

/// Builds the tree over `references`, which `bounds` holds.
fn build(
    place: Place<'_>,
    bounds: Aabb,
    references: &mut [Reference],
    depth: u32,
    scratch: &mut Bins,
) {
    let Place {
        node,
        below,
        first_below,
    } = place;
    if let [reference] = references {
        *node = *reference;
        return;
    }
    *node = Bvh2Node::new(bounds, 0, first_below as u32);
    let n = references.len();
    let Sides { n_left, bounds } = cut(references, depth, scratch);
    let (left, right) = references.split_at_mut(n_left);
    let [left_place, right_place] = Place::split(below, first_below, n_left);
    if n >= MIN_PARALLEL {
        rayon::join(
            || build(left_place, bounds[0], left, depth + 1, scratch),
            || build(right_place, bounds[1], right, depth + 1, &mut Bins::new()),
        );
    } else {
        build(left_place, bounds[0], left, depth + 1, scratch);
        build(right_place, bounds[1], right, depth + 1, scratch);
    }
}

/// What a node is cut into.
struct Sides {
    n_left: usize,
    bounds: [Aabb; 2],
}

/// Moves the references of the first child to the front.
fn cut(references: &mut [Reference], depth: u32, bins: &mut Bins) -> Sides {
    let n = references.len();
    if n == 2 || depth + n.next_power_of_two().ilog2() >= MAX_DEPTH {
        return halves(references);
    }
    let centers = centers_of(references);
    if n <= MAX_MIDDLE {
        return middle(references, &centers);
    }
    let binning = Binning::new(&centers, n);
    fill(bins, references, &binning);
    let Some(cut) = bins.best_cut(binning.n_bins) else {
        return halves(references);
    };
    let is_left = |reference: &Reference| binning.bin_of(reference, cut.axis) < cut.bin;
    Sides {
        bounds: bins.sides(&cut, binning.n_bins),
        n_left: partition(references, is_left),
    }
}

/// Cuts few references amid their centers.
fn middle(references: &mut [Reference], centers: &Centers) -> Sides {
    let extent = (centers.most - centers.least).truncate();
    let axis = extent.max_position();
    if extent[axis] == 0.0 {
        return halves(references);
    }
    let middle = centers.least[axis] + 0.5 * extent[axis];
    // Of two numbers without one between them, the middle is rounded to either.
    let n_left = partition(references, |r| {
        let center = doubled_center_at(r, axis);
        center <= middle && center < centers.most[axis]
    });
    let (left, right) = references.split_at(n_left);
    Sides {
        n_left,
        bounds: [bounds_of(left), bounds_of(right)],
    }
}

fn halves(references: &[Reference]) -> Sides {
    let (left, right) = references.split_at(references.len() / 2);
    Sides {
        n_left: left.len(),
        bounds: [bounds_of(left), bounds_of(right)],
    }
}

fn bounds_of(references: &[Reference]) -> Aabb {
    let bounds = references.iter().map(Bvh2Node::aabb);
    bounds.fold(Aabb::INVALID, |all, bounds| all.union(bounds))
}

fn centers_of(references: &[Reference]) -> Centers {
    if references.len() <= CHUNK {
        return Centers::of(references);
    }
    let chunks = references.par_chunks(CHUNK).map(Centers::of);
    chunks.reduce(|| Centers::NONE, Centers::union)
}

fn fill(bins: &mut Bins, references: &[Reference], binning: &Binning) {
    if references.len() <= CHUNK {
        return bins.refill(references, binning);
    }
    let chunks = references.par_chunks(CHUNK).map(|chunk| {
        let mut bins = Bins::new();
        bins.refill(chunk, binning);
        bins
    });
    *bins = chunks.reduce(Bins::new, |all, bins| all.merge(&bins));
}

/// Moves what `is_left` accepts to the front; returns how many that are. Without a branch for
/// each: which side comes next, no processor guesses.
fn partition(references: &mut [Reference], is_left: impl Fn(&Reference) -> bool) -> usize {
    let mut n_left = 0;
    for i in 0..references.len() {
        let goes_left = is_left(&references[i]);
        // Where it stays on the right it only changes places there.
        references.swap(i, n_left);
        n_left += usize::from(goes_left);
    }
    n_left
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::reference::references;
    use kilauea_math::Vec3A;

    fn boxes(n: usize, place: impl Fn(usize) -> f32) -> Vec<Aabb> {
        (0..n)
            .map(|i| {
                let low = Vec3A::new(place(i), (i % 7) as f32, 0.0);
                Aabb::new(low, low + 1.0)
            })
            .collect()
    }

    fn check(boxes: &[Aabb]) -> Bvh2 {
        let bvh = over(references(boxes.iter().copied()));
        let mut seen = vec![0; boxes.len()];
        let mut open = vec![(0, 0)];
        while let Some((index, depth)) = open.pop() {
            let node = &bvh.nodes[index];
            assert!(depth <= MAX_DEPTH);
            if node.is_leaf() {
                let item = node.first_index as usize;
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
        for n in [1, 2, 3, 10, 5000, 3 * CHUNK] {
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
