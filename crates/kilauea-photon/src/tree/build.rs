use kilauea_math::{Bounds3, Vec3};
use rayon::prelude::*;

use super::{MortonGrid, Node, PointBlock, PointTree, WIDTH};

impl PointTree {
    /// A tree over points, and the order in which it holds them: at place `i` lies the point that
    /// was number `order[i]`. Points in one cell of the curve are ordered by `key`, so that the
    /// tree does not depend on the order in which they come.
    pub(crate) fn build(
        n_points: usize,
        point: impl Fn(usize) -> Vec3 + Sync,
        key: impl Fn(usize) -> u64 + Sync,
    ) -> (Self, Vec<u32>) {
        assert!(u32::try_from(n_points).is_ok(), "{n_points} points");
        let order = curve_order(n_points, &point, key);
        let blocks: Vec<PointBlock> = order
            .par_chunks(WIDTH)
            .map(|chunk| PointBlock::new(chunk.iter().map(|&i| point(i as usize))))
            .collect();
        let (nodes, level_starts) = levels_above(&blocks);
        let tree = Self {
            n_points,
            blocks,
            nodes,
            level_starts,
        };
        (tree, order)
    }
}

/// Point numbers along Morton's curve.
fn curve_order(
    n_points: usize,
    point: &(impl Fn(usize) -> Vec3 + Sync),
    key: impl Fn(usize) -> u64 + Sync,
) -> Vec<u32> {
    let bounds = (0..n_points)
        .into_par_iter()
        .map(|i| Bounds3::from_points([point(i)]))
        .reduce(|| Bounds3::EMPTY, |a, b| a.union(&b));
    let grid = MortonGrid::around(&bounds);
    let mut coded: Vec<(u64, u32)> = (0..n_points)
        .into_par_iter()
        .map(|i| (grid.code(point(i)), i as u32))
        .collect();
    coded.par_sort_unstable_by(|(code_a, a), (code_b, b)| {
        code_a
            .cmp(code_b)
            .then_with(|| key(*a as usize).cmp(&key(*b as usize)))
            .then_with(|| a.cmp(b))
    });
    coded.into_par_iter().map(|(_, i)| i).collect()
}

/// All nodes, and where each level begins: eight neighbours below make a node above.
fn levels_above(blocks: &[PointBlock]) -> (Vec<Node>, Vec<usize>) {
    let mut nodes = Vec::new();
    let mut level_starts = Vec::new();
    let mut below: Vec<Bounds3> = blocks.par_iter().map(PointBlock::bounds).collect();
    loop {
        let level: Vec<Node> = below
            .par_chunks(WIDTH)
            .map(|children| Node::new(children.iter().copied()))
            .collect();
        level_starts.push(nodes.len());
        below = level.par_iter().map(Node::bounds).collect();
        nodes.extend(level);
        if below.len() <= 1 {
            return (nodes, level_starts);
        }
    }
}
