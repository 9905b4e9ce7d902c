use kilauea_math::{Vec2, Vec3};

use crate::direction_tree::{DirectionTree, split};

/// Directions from one place: those that were found near it, and those of a larger region, which
/// knows more of what is rare.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Directions<'a> {
    /// None where nothing was found near.
    pub near: Option<&'a DirectionTree>,
    /// The region.
    pub around: &'a DirectionTree,
}

/// Fraction of directions that are the region's, where there are nearer ones.
const AROUND_SHARE: f32 = 0.2;

impl<'a> Directions<'a> {
    /// Of a region alone.
    #[inline]
    pub const fn around(around: &'a DirectionTree) -> Self {
        Self { near: None, around }
    }

    /// Draws a direction; `u` is uniform in [0, 1)².
    #[inline]
    pub fn sample(&self, mut u: Vec2) -> Vec3 {
        match self.near {
            Some(near) if split(&mut u.x, AROUND_SHARE) == 1 => near.sample(u),
            _ => self.around.sample(u),
        }
    }

    /// Density per solid angle with which [`Self::sample`] finds a unit direction.
    #[inline]
    pub fn pdf(&self, wi: Vec3) -> f32 {
        let around = self.around.pdf(wi);
        match self.near {
            Some(near) => AROUND_SHARE * around + (1.0 - AROUND_SHARE) * near.pdf(wi),
            None => around,
        }
    }
}
