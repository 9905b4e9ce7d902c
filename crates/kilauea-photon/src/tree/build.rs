use kilauea_math::{Bounds3, Vec3};
use rayon::prelude::*;

use super::order::{Entry, order_by_halves};
use super::{Node, PointBlock, PointTree, WIDTH};

impl PointTree {
    /// A tree over points, and the order in which it holds them: at place `i` lies the point that
    /// was number `order[i]`. Points are told apart by `key`, so that the tree does not depend on
    /// the order in which they come.
    ///
    /// # Panics
    ///
    /// If there are 2³² points or more.
    pub(crate) fn build(
        n_points: usize,
        point: impl Fn(usize) -> Vec3 + Sync,
        key: impl Fn(usize) -> u64 + Sync,
    ) -> (Self, Vec<u32>) {
        assert!(u32::try_from(n_points).is_ok(), "{n_points} points");
        let entry = |i: usize| Entry {
            p: point(i),
            idx: i as u32,
        };
        let mut entries: Vec<Entry> = (0..n_points).into_par_iter().map(entry).collect();
        order_by_halves(&mut entries, &|idx| key(idx as usize));

        let blocks: Vec<PointBlock> = entries
            .par_chunks(WIDTH)
            .map(|chunk| PointBlock::new(chunk.iter().map(|entry| entry.p)))
            .collect();
        let (nodes, level_starts) = levels_above(&blocks);
        let tree = Self {
            n_points,
            blocks,
            nodes,
            level_starts,
        };
        (
            tree,
            entries.into_par_iter().map(|entry| entry.idx).collect(),
        )
    }
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
