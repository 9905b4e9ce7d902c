//! Large nodes of a binary tree put where they cost less (Meister & Bittner 2018).

use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Nodes tried at a time, of so many: the largest, which most rays meet.
const NODES_A_CANDIDATE: usize = 32;
/// But no more than these.
const MAX_CANDIDATES: usize = 1 << 13;
/// Times that they are tried.
const N_ROUNDS: usize = 3;

/// Takes nodes out and puts them in elsewhere, where that makes the tree cheaper.
pub(crate) fn refine(bvh: &mut Bvh2) {
    let n_candidates = (bvh.nodes.len() / NODES_A_CANDIDATE).min(MAX_CANDIDATES);
    if n_candidates == 0 {
        return;
    }
    let mut optimizer = ReinsertionOptimizer::default();
    for _ in 0..N_ROUNDS {
        let candidates = largest(bvh, n_candidates);
        optimizer.run_with_candidates(bvh, &candidates, 1);
    }
}

/// The `n` largest nodes but the root: from the top, since none is larger than its parent.
fn largest(bvh: &Bvh2, n: usize) -> Vec<u32> {
    let keyed = |index: u32| {
        let area = bvh.nodes[index as usize].aabb().half_area();
        (area.to_bits(), Reverse(index))
    };
    let mut open = BinaryHeap::from([keyed(0)]);
    let mut found = Vec::with_capacity(n);
    while let Some((_, Reverse(index))) = open.pop()
        && found.len() < n
    {
        let node = &bvh.nodes[index as usize];
        if index != 0 {
            found.push(index);
        }
        if !node.is_leaf() {
            open.extend([node.first_index, node.first_index + 1].map(keyed));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::binned;
    use crate::build::reference::references;
    use kilauea_math::Vec3A;
    use kilauea_math::hash::{combine, unit_f32};
    use obvhs::aabb::Aabb;

    /// Of the nodes that are no leaves.
    fn total_area(bvh: &Bvh2) -> f32 {
        let inner = bvh.nodes.iter().filter(|node| !node.is_leaf());
        inner.map(|node| node.aabb().half_area()).sum()
    }

    #[test]
    fn nodes_get_smaller_and_keep_their_leaves() {
        let mut bvh = binned::over(references((0..3000).map(|i| {
            let number = |dimension| unit_f32(combine(i, dimension));
            let low = Vec3A::new(number(0), number(1), number(2));
            Aabb::new(low, low + 0.3 * number(3).powi(4))
        })));
        let before = total_area(&bvh);
        refine(&mut bvh);
        assert!(total_area(&bvh) < before);
        let mut leaves = Vec::new();
        let mut open = vec![0];
        while let Some(index) = open.pop() {
            let node = &bvh.nodes[index as usize];
            if node.is_leaf() {
                leaves.push(node.first_index);
            } else {
                open.extend([node.first_index, node.first_index + 1]);
            }
        }
        leaves.sort_unstable();
        assert!(leaves.into_iter().eq(0..3000));
    }
}
