//! Large soups are cut into buckets first, so that trees are built on all cores, within caches,
//! and without scratch memory for the whole scene.

use super::binned::{N_BINS, best_bin, partition};
use super::pair::Pair;
use kilauea_math::Vec3A;
use obvhs::aabb::Aabb;

/// Most pairs of a bucket.
pub(crate) const MAX_BUCKET: usize = 1 << 24;

/// Pairs looked at to choose a cut.
const N_SAMPLES: usize = 1 << 14;

/// Reorders the pairs into compact buckets by the surface area heuristic, and returns those.
pub(crate) fn cut(pairs: &mut [Pair]) -> Vec<&mut [Pair]> {
    if pairs.len() <= MAX_BUCKET {
        return vec![pairs];
    }
    let middle = choose_cut(pairs).map_or(0, |(axis, at)| {
        partition(pairs, |pair| pair.bounds().center()[axis] < at)
    });
    // Where the heuristic finds nothing, or next to nothing, any halves will do.
    let least = pairs.len() / 64;
    let middle = if (least..pairs.len() - least).contains(&middle) {
        middle
    } else {
        pairs.len() / 2
    };
    let (low, high) = pairs.split_at_mut(middle);
    let (mut buckets, rest) = rayon::join(|| cut(low), || cut(high));
    buckets.extend(rest);
    buckets
}

/// The axis and coordinate of the cheapest cut, judged by a sample; none where all centers agree.
fn choose_cut(pairs: &[Pair]) -> Option<(usize, f32)> {
    let stride = pairs.len().div_ceil(N_SAMPLES);
    let sample: Vec<Aabb> = pairs.iter().step_by(stride).map(Pair::bounds).collect();
    let (min, max) = sample
        .iter()
        .fold((Vec3A::INFINITY, Vec3A::NEG_INFINITY), |(min, max), b| {
            (min.min(b.center()), max.max(b.center()))
        });
    let cuts = (0..3)
        .filter(|&axis| max[axis] > min[axis])
        .filter_map(|axis| {
            let bin_size = (max[axis] - min[axis]) / N_BINS as f32;
            let mut bins = [(Aabb::INVALID, 0_u32); N_BINS];
            for b in &sample {
                let bin = (((b.center()[axis] - min[axis]) / bin_size) as usize).min(N_BINS - 1);
                bins[bin] = (bins[bin].0.union(b), bins[bin].1 + 1);
            }
            best_bin(&bins).map(|(cost, bin)| (cost, axis, min[axis] + bin as f32 * bin_size))
        });
    cuts.min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, axis, at)| (axis, at))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::soup::SoupTriangle;

    fn grid(n: usize) -> Vec<Pair> {
        (0..n)
            .map(|i| {
                let p = [(i % 997) as f32, (i / 997) as f32, 0.0];
                Pair::single(&SoupTriangle {
                    v: [p, [p[0] + 1.0, p[1], 0.0], [p[0], p[1] + 1.0, 0.0]],
                    triangle: i as u32,
                    instance: 0,
                })
            })
            .collect()
    }

    #[test]
    fn buckets_hold_every_pair_once_and_lie_apart() {
        let n = 3 * MAX_BUCKET;
        let mut pairs = grid(n);
        let buckets = cut(&mut pairs);
        assert!(
            buckets
                .iter()
                .all(|b| !b.is_empty() && b.len() <= MAX_BUCKET)
        );
        let area = |b: &[Pair]| {
            b.iter()
                .fold(Aabb::INVALID, |a, pair| a.union(&pair.bounds()))
                .half_area()
        };
        let total: f32 = buckets.iter().map(|b| area(b)).sum();
        let mut ids: Vec<u32> = buckets
            .iter()
            .flat_map(|b| b.iter().map(|pair| pair.triangle_ids()[0]))
            .collect();
        ids.sort_unstable();
        assert!(ids.into_iter().eq(0..n as u32));
        assert!(total < 1.1 * area(&grid(n)), "{total}");
    }

    #[test]
    fn equal_pairs_are_halved() {
        let mut pairs = vec![grid(1)[0]; 2 * MAX_BUCKET + 1];
        assert!(cut(&mut pairs).iter().all(|b| b.len() <= MAX_BUCKET));
    }
}
