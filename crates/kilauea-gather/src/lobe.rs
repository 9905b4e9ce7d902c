use kilauea_math::Vec3;
use std::f32::consts::PI;

use crate::direction_tree::{DirectionTree, Square};

/// What a distribution over directions looks like at a glance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobe {
    /// Mean of all directions. Its length is one where all are the same, and zero where they are even.
    pub mean: Vec3,
    /// Greatest density over that of even directions.
    pub peak: f32,
}

/// Squares are looked at where they are no larger than this, so that each is about one direction.
const MAX_SIDE: f32 = 1.0 / 32.0;

impl DirectionTree {
    /// What it looks like.
    pub fn lobe(&self) -> Lobe {
        let mut lobe = Lobe {
            mean: Vec3::ZERO,
            peak: 0.0,
        };
        self.for_each_leaf(&mut |leaf, probability| lobe.add(leaf, probability));
        lobe
    }
}

impl Lobe {
    fn add(&mut self, square: Square, probability: f32) {
        if square.side > MAX_SIDE {
            for quarter in square.quarters() {
                self.add(quarter, 0.25 * probability);
            }
            return;
        }
        self.mean += probability * square.direction();
        let density = probability / square.solid_angle();
        self.peak = self.peak.max(4.0 * PI * density);
    }
}
