//! Where to cut a node, judged at bins of the boxes' centers (Wald 2007).

use super::reference::{Centers, Reference, doubled_center, doubled_center_at};
use kilauea_math::Vec4;
use obvhs::aabb::Aabb;

/// Most bins by axis.
const N_BINS: usize = 32;

/// From here on `f32` has whole numbers only, whose last bits are those of integers.
const WHOLE: f32 = (1_u32 << 23) as f32;

/// From centers to bins: each goes to the bin whose middle is nearest, of middles in even steps
/// from the least center to the greatest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Binning {
    least: Vec4,
    steps_per_length: Vec4,
    pub(super) n_bins: usize,
}

impl Binning {
    /// For `n` boxes with these centers; few boxes need few bins.
    pub(super) fn new(centers: &Centers, n: usize) -> Self {
        let n_bins = N_BINS.min(4 + n / 2);
        let steps = Vec4::splat((n_bins - 1) as f32) / (centers.most - centers.least);
        // An axis without extent has one bin.
        let steps = steps
            .to_array()
            .map(|s| if s.is_finite() { s } else { 0.0 });
        // Ones keep the products of what is no coordinate from being denormal, which is slow.
        Self {
            least: centers.least.truncate().extend(1.0),
            steps_per_length: Vec4::from_array(steps).truncate().extend(1.0),
            n_bins,
        }
    }

    /// The bin along one axis.
    #[inline]
    pub(super) fn bin_of(&self, reference: &Reference, axis: usize) -> usize {
        let from_least = doubled_center_at(reference, axis) - self.least[axis];
        let whole = from_least * self.steps_per_length[axis] + WHOLE;
        whole.to_bits() as usize % N_BINS
    }

    /// The bin along each axis: by the same arithmetic, all at once.
    #[inline]
    fn bins_of(&self, reference: &Reference) -> [usize; 3] {
        let step = (doubled_center(reference) - self.least) * self.steps_per_length;
        let [x, y, z, _] = (step + Vec4::splat(WHOLE)).to_array();
        [x, y, z].map(|whole| whole.to_bits() as usize % N_BINS)
    }
}

/// What falls into the bins of each axis.
#[derive(Clone)]
pub(super) struct Bins {
    bounds: [[Aabb; N_BINS]; 3],
    n: [[u32; N_BINS]; 3],
}

impl Bins {
    pub(super) fn new() -> Self {
        Self {
            bounds: [[Aabb::INVALID; N_BINS]; 3],
            n: [[0; N_BINS]; 3],
        }
    }

    /// Sorts the references into the bins, which held something else before.
    pub(super) fn refill(&mut self, references: &[Reference], binning: &Binning) {
        for axis in 0..3 {
            self.bounds[axis][..binning.n_bins].fill(Aabb::INVALID);
            self.n[axis][..binning.n_bins].fill(0);
        }
        for reference in references {
            for (axis, bin) in binning.bins_of(reference).into_iter().enumerate() {
                let bounds = &mut self.bounds[axis][bin];
                *bounds = bounds.union(reference.aabb());
                self.n[axis][bin] += 1;
            }
        }
    }

    /// Adds what is in the `other` bins.
    pub(super) fn merge(mut self, other: &Self) -> Self {
        for axis in 0..3 {
            for bin in 0..N_BINS {
                let bounds = &mut self.bounds[axis][bin];
                *bounds = bounds.union(&other.bounds[axis][bin]);
                self.n[axis][bin] += other.n[axis][bin];
            }
        }
        self
    }

    /// The cheapest cut by the surface area heuristic; none if all is in one bin of each axis.
    pub(super) fn best_cut(&self, n_bins: usize) -> Option<Cut> {
        let mut best: Option<Cut> = None;
        let mut right_cost = [0.0; N_BINS];
        for axis in 0..3 {
            let (bounds, n) = (&self.bounds[axis][..n_bins], &self.n[axis][..n_bins]);
            let mut right = (Aabb::INVALID, 0);
            for bin in (1..n_bins).rev() {
                right = (right.0.union(&bounds[bin]), right.1 + n[bin]);
                right_cost[bin] = cost(right);
            }
            let mut left = (Aabb::INVALID, 0);
            for bin in 1..n_bins {
                left = (left.0.union(&bounds[bin - 1]), left.1 + n[bin - 1]);
                let cost = cost(left) + right_cost[bin];
                if cost < best.map_or(f32::INFINITY, |best| best.cost) {
                    best = Some(Cut { axis, bin, cost });
                }
            }
        }
        best
    }

    /// Boxes around what is on either side of a cut.
    pub(super) fn sides(&self, cut: &Cut, n_bins: usize) -> [Aabb; 2] {
        let around = |bins: &[Aabb]| bins.iter().fold(Aabb::INVALID, |all, b| all.union(b));
        let (left, right) = self.bounds[cut.axis][..n_bins].split_at(cut.bin);
        [around(left), around(right)]
    }
}

/// A cut before a bin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cut {
    pub(super) axis: usize,
    /// The first of the second side.
    pub(super) bin: usize,
    cost: f32,
}

fn cost((bounds, n): (Aabb, u32)) -> f32 {
    if n == 0 {
        f32::INFINITY
    } else {
        bounds.half_area() * n as f32
    }
}
