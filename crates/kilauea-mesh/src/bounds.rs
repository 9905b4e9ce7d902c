use kilauea_math::{DAffine3, DVec3};

/// An axis-aligned box in `f64`, for placing things far from the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DBounds {
    pub(crate) min: DVec3,
    pub(crate) max: DVec3,
}

impl DBounds {
    pub(crate) const EMPTY: Self = Self {
        min: DVec3::INFINITY,
        max: DVec3::NEG_INFINITY,
    };

    pub(crate) fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    pub(crate) fn include(&mut self, p: DVec3) {
        self.min = self.min.min(p);
        self.max = self.max.max(p);
    }

    pub(crate) fn union(&self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    pub(crate) fn center(&self) -> DVec3 {
        0.5 * self.min + 0.5 * self.max
    }

    /// The box around this box in another space.
    pub(crate) fn transformed(&self, to_from: &DAffine3) -> Self {
        let mut bounds = Self::EMPTY;
        if self.is_empty() {
            return bounds;
        }
        for x in [self.min.x, self.max.x] {
            for y in [self.min.y, self.max.y] {
                for z in [self.min.z, self.max.z] {
                    bounds.include(to_from.transform_point3(DVec3::new(x, y, z)));
                }
            }
        }
        bounds
    }

    /// Distance from a point to the nearest point of the box; zero inside.
    pub(crate) fn distance(&self, p: DVec3) -> f64 {
        p.distance(p.clamp(self.min, self.max))
    }
}

/// Whether a transform flattens space, so that it has no inverse, or is not finite.
pub(crate) fn is_singular(transform: &DAffine3) -> bool {
    let m = transform.matrix3;
    let size = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
    // Written so that NaN counts as singular.
    let regular = m.determinant().abs() > 1e-14 * size;
    !(regular && transform.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flattening_transforms_are_singular() {
        assert!(!is_singular(&DAffine3::from_scale(DVec3::splat(1e-30))));
        assert!(!is_singular(&DAffine3::from_scale(DVec3::new(
            -1.0, 1e6, 1e-6
        ))));
        assert!(is_singular(&DAffine3::from_scale(DVec3::new(
            1.0, 0.0, 1.0
        ))));
        assert!(is_singular(&DAffine3::from_scale(DVec3::NAN)));
        assert!(is_singular(&DAffine3::from_translation(DVec3::INFINITY)));
    }

    #[test]
    fn distance_is_zero_inside_and_exact_outside() {
        let mut b = DBounds::EMPTY;
        b.include(DVec3::ZERO);
        b.include(DVec3::ONE);
        assert_eq!(b.distance(DVec3::splat(0.5)), 0.0);
        assert_eq!(b.distance(DVec3::new(4.0, 5.0, 0.5)), 5.0);
    }
}
