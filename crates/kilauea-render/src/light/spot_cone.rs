use kilauea_math::Vec3;
use std::f32::consts::PI;

/// A cone of directions around all bright spots of a dome.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SpotCone {
    axis: Vec3,
    min_cos: f32,
}

impl SpotCone {
    const SPHERE: Self = Self {
        axis: Vec3::ZERO,
        min_cos: 0.0,
    };

    /// Around unit directions and `margin` radians more; none without any.
    pub(super) fn around(dirs: &[Vec3], margin: f32) -> Option<Self> {
        if dirs.is_empty() {
            return None;
        }
        let Some(axis) = dirs.iter().sum::<Vec3>().try_normalize() else {
            return Some(Self::SPHERE);
        };
        let min_cos = dirs.iter().map(|dir| axis.dot(*dir)).fold(1.0, f32::min);
        let angle = min_cos.clamp(-1.0, 1.0).acos() + margin;
        Some(if angle < PI {
            Self {
                axis,
                min_cos: angle.cos(),
            }
        } else {
            Self::SPHERE
        })
    }

    #[inline]
    pub(super) fn contains(&self, dir: Vec3) -> bool {
        self.axis.dot(dir) >= self.min_cos
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cone_holds_what_it_was_made_around_and_no_more_than_the_margin() {
        let dirs = [Vec3::X, Vec3::new(0.8, 0.6, 0.0), Vec3::new(0.8, 0.0, 0.6)];
        let cone = SpotCone::around(&dirs, 1e-3).expect("there are directions");
        assert!(dirs.iter().all(|dir| cone.contains(*dir)));
        assert!(!cone.contains(Vec3::new(0.8, -0.6, 0.0)) && !cone.contains(-Vec3::X));
    }

    #[test]
    fn directions_all_around_leave_nothing_out() {
        let opposite = SpotCone::around(&[Vec3::X, -Vec3::X], 0.1);
        let cone = opposite.expect("there are directions");
        let all = [Vec3::X, -Vec3::X, Vec3::Y, Vec3::Z];
        assert!(all.iter().all(|dir| cone.contains(*dir)));
        assert_eq!(SpotCone::around(&[], 0.1), None);
    }
}
