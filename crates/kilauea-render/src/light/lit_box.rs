use kilauea_math::{Bounds3, Vec2, Vec3};

/// What light from infinity shines on: the box around all surfaces.
///
/// Its cross-section is never larger than that of the sphere around it, and in flat scenes far
/// smaller, so that fewer photons miss.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LitBox {
    bounds: Bounds3,
}

impl LitBox {
    /// `bounds` is around all surfaces. None if there are none.
    pub(super) fn new(bounds: Bounds3) -> Option<Self> {
        let extent = bounds.diagonal().max_element();
        let reach = bounds.min.abs().max(bounds.max.abs()).max_element();
        // Off the surfaces that lie in a face, by more than rounding moves a ray.
        let margin = (1e-4 * extent).max(1e-5 * reach).max(f32::MIN_POSITIVE);
        let bounds = Bounds3 {
            min: bounds.min - margin,
            max: bounds.max + margin,
        };
        (extent >= 0.0 && bounds.diagonal().is_finite()).then_some(Self { bounds })
    }

    /// Area of the shadow that the box throws along the unit vector `dir`.
    pub(super) fn cross_section(&self, dir: Vec3) -> f32 {
        self.face_shadows(dir).element_sum()
    }

    /// The mean of [`Self::cross_section`] over all directions: a quarter of the surface, as for
    /// every convex body (Cauchy 1841).
    pub(super) fn mean_cross_section(&self) -> f32 {
        0.5 * self.bounds.half_area()
    }

    /// Where a ray along the unit vector `dir` enters the box; `u` spreads such rays evenly over
    /// the cross-section.
    pub(super) fn entry(&self, dir: Vec3, u: Vec2) -> Vec3 {
        let shadows = self.face_shadows(dir);
        let mut rest = u.x * shadows.element_sum();
        let mut axis = 0;
        while axis < 2 && rest >= shadows[axis] {
            rest -= shadows[axis];
            axis += 1;
        }
        let along_x = if shadows[axis] > 0.0 {
            (rest / shadows[axis]).min(1.0)
        } else {
            0.5
        };
        let Bounds3 { min, max } = self.bounds;
        let mut weights = Vec3::ZERO;
        weights[axis] = if dir[axis] > 0.0 { 0.0 } else { 1.0 };
        weights[(axis + 1) % 3] = along_x;
        weights[(axis + 2) % 3] = u.y;
        min + weights * (max - min)
    }

    /// Where the line through `p` along the unit vector `dir` enters the box; `p` where it does not.
    pub(super) fn entry_of(&self, p: Vec3, dir: Vec3) -> Vec3 {
        let [t_in, t_out] = self.overlap(p, dir);
        // Along an axis, the distance to a slab that is not met is infinite.
        if t_in <= t_out { p + t_in * dir } else { p }
    }

    /// Whether the line through `p` along the unit vector `dir` meets the box.
    pub(super) fn is_met(&self, p: Vec3, dir: Vec3) -> bool {
        let [t_in, t_out] = self.overlap(p, dir);
        t_in <= t_out
    }

    /// The distances from `p` at which a line is in all slabs; the wrong way round if in none.
    fn overlap(&self, p: Vec3, dir: Vec3) -> [f32; 2] {
        let (a, b) = ((self.bounds.min - p) / dir, (self.bounds.max - p) / dir);
        [a.min(b).max_element(), a.max(b).min_element()]
    }

    /// Areas of the shadows of the three faces that look against `dir`, by the axis that they are
    /// perpendicular to.
    fn face_shadows(&self, dir: Vec3) -> Vec3 {
        let d = self.bounds.diagonal();
        dir.abs() * Vec3::new(d.y * d.z, d.z * d.x, d.x * d.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Boxes at which light is aimed reach a little beyond all surfaces; light along an axis would enter
    /// at infinity there.
    #[test]
    fn lines_beside_the_box_start_somewhere() {
        let bounds = Bounds3 {
            min: Vec3::ZERO,
            max: Vec3::ONE,
        };
        let lit = LitBox::new(bounds).expect("it has a size");
        for down in [Vec3::NEG_Y, Vec3::new(-0.0, -1.0, -6e-17)] {
            for x in [-1.0, -1e-4, 0.0, 0.5, 1.0, 1.0001, 2.0] {
                let entry = lit.entry_of(Vec3::new(x, 0.5, 0.5), down);
                assert!(entry.is_finite(), "{x}: {entry}");
            }
            let inside = lit.entry_of(Vec3::splat(0.5), down);
            assert!((inside.y - 1.0001).abs() < 1e-6, "{inside}");
        }
    }
}
