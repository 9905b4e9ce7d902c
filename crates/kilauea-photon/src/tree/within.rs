use kilauea_math::Vec3;

use super::{MAX_LEVELS, PointTree, WIDTH, bound_sq};

impl PointTree {
    /// Calls `visit(index, squared distance)` for all points at most `radius` from `p`, in
    /// ascending order of their indices.
    #[inline]
    pub(crate) fn for_each_within(&self, p: Vec3, radius: f32, mut visit: impl FnMut(usize, f32)) {
        let radius_sq = bound_sq(radius);
        self.for_each_block_within(p, radius_sq, |block_idx| {
            let d_sq = self.blocks[block_idx].distances_sq(p);
            for lane in lanes(within(&d_sq, radius_sq)) {
                visit(block_idx * WIDTH + lane, d_sq[lane]);
            }
        });
    }

    /// Calls `visit` for all blocks whose boxes are near enough, in ascending order.
    ///
    /// Since the tree is implicit, a walk needs to remember no more than one node, and for each
    /// level the children that are still to come.
    #[inline]
    fn for_each_block_within(&self, p: Vec3, radius_sq: f32, mut visit: impl FnMut(usize)) {
        if self.blocks.is_empty() || !p.is_finite() {
            return;
        }
        let top = self.level_starts.len() - 1;
        let mut pending = [0_u8; MAX_LEVELS];
        let (mut level, mut idx) = (top, 0);
        pending[top] = within(&self.node(top, 0).distances_sq(p), radius_sq);
        loop {
            if pending[level] == 0 {
                if level == top {
                    return;
                }
                level += 1;
                idx /= WIDTH;
                continue;
            }
            let child = idx * WIDTH + pending[level].trailing_zeros() as usize;
            pending[level] &= pending[level] - 1;
            if level == 0 {
                visit(child);
            } else {
                level -= 1;
                idx = child;
                pending[level] = within(&self.node(level, idx).distances_sq(p), radius_sq);
            }
        }
    }
}

/// One bit for each distance that is at most the radius.
#[inline]
fn within(d_sq: &[f32; WIDTH], radius_sq: f32) -> u8 {
    let bit = |lane: usize| u8::from(d_sq[lane] <= radius_sq) << lane;
    (0..WIDTH).fold(0, |mask, lane| mask | bit(lane))
}

/// The set bits, ascending.
#[inline]
fn lanes(mut mask: u8) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = (mask != 0).then(|| mask.trailing_zeros() as usize)?;
        mask &= mask - 1;
        Some(lane)
    })
}
