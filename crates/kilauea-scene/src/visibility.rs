use std::ops::{BitAnd, BitOr};

use serde::{Deserialize, Serialize};

/// Which kinds of rays meet something: a set of bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Visibility(pub u8);

impl Visibility {
    /// No ray at all.
    pub const NONE: Self = Self(0);
    /// Rays from the camera.
    pub const CAMERA: Self = Self(1);
    /// Rays toward lights.
    pub const SHADOW: Self = Self(2);
    /// Rays that a surface scattered.
    pub const INDIRECT: Self = Self(4);
    /// Every ray.
    pub const ALL: Self = Self(7);

    /// Whether no ray of ours is in the set.
    pub fn is_none(self) -> bool {
        self & Self::ALL == Self::NONE
    }
}

impl Default for Visibility {
    fn default() -> Self {
        Self::ALL
    }
}

impl BitAnd for Visibility {
    type Output = Self;

    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOr for Visibility {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}
