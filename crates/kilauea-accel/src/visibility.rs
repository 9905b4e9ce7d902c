use std::ops::{BitAnd, BitOr};

/// Which kinds of rays see something, or of which kinds a ray is, one bit each. A ray meets what it
/// shares a bit with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Visibility(pub u8);

impl Visibility {
    /// Nothing.
    pub const NONE: Self = Self(0);
    /// Rays from the camera.
    pub const CAMERA: Self = Self(1);
    /// Rays towards lights.
    pub const SHADOW: Self = Self(2);
    /// Scattered rays.
    pub const INDIRECT: Self = Self(4);
    /// All kinds.
    pub const ALL: Self = Self(7);

    /// Whether any kind is in both.
    #[inline]
    pub fn meets(self, other: Self) -> bool {
        self.0 & other.0 != 0
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
