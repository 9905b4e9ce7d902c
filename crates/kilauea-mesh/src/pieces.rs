use kilauea_math::Vec3;
use rayon::prelude::*;

/// Splits items into compact groups of at most `limit`, by medians along the longest axis of their
/// centroids. Items that fit in one group keep their order; in each group it is kept as well.
pub(crate) fn split_into_pieces<T: Copy + Send + Sync>(
    items: Vec<T>,
    limit: usize,
    centroid: impl Fn(&T) -> Vec3 + Send + Sync,
) -> Vec<Vec<T>> {
    let limit = limit.max(1);
    if items.is_empty() {
        return Vec::new();
    }
    if items.len() <= limit {
        return vec![items];
    }
    let mut keyed: Vec<Keyed> = items
        .par_iter()
        .map(centroid)
        .zip(0..items.len() as u32)
        .collect();
    let groups = split_at_medians(&mut keyed, limit);
    let piece = |group: &[Keyed]| group.iter().map(|&(_, i)| items[i as usize]).collect();
    groups.into_par_iter().map(piece).collect()
}

/// A centroid and the number of its item.
type Keyed = (Vec3, u32);

fn split_at_medians(group: &mut [Keyed], limit: usize) -> Vec<&[Keyed]> {
    if group.len() <= limit {
        group.sort_unstable_by_key(|&(_, i)| i);
        return vec![group];
    }
    let nothing = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (min, max) = group
        .iter()
        .fold(nothing, |(min, max), (c, _)| (min.min(*c), max.max(*c)));
    let axis = (max - min).max_position();
    let n_pieces = group.len().div_ceil(limit);
    let middle = group.len() * (n_pieces / 2) / n_pieces;
    // Equal keys are ordered by index, so that the halves do not depend on the algorithm.
    group.select_nth_unstable_by(middle, |(a, i), (b, j)| {
        a[axis].total_cmp(&b[axis]).then(i.cmp(j))
    });
    let (low, high) = group.split_at_mut(middle);
    let (mut low, high) = rayon::join(
        || split_at_medians(low, limit),
        || split_at_medians(high, limit),
    );
    low.extend(high);
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_hold_everything_once_and_are_compact() {
        let items: Vec<u32> = (0..1000).collect();
        // A 100 × 10 grid.
        let centroid = |&i: &u32| Vec3::new((i % 100) as f32, (i / 100) as f32, 0.0);
        let pieces = split_into_pieces(items.clone(), 110, centroid);
        assert_eq!(pieces.len(), 10);
        let mut all: Vec<u32> = pieces.iter().flatten().copied().collect();
        all.sort_unstable();
        assert_eq!(all, items);
        for piece in &pieces {
            assert!(piece.len() <= 110 && piece.is_sorted());
            let x: Vec<u32> = piece.iter().map(|i| i % 100).collect();
            let width = x.iter().max().unwrap() - x.iter().min().unwrap();
            assert!(width <= 13, "{width}");
        }
    }
}
