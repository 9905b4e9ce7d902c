//! Cubic Bézier curves with a radius along them.

use super::bernstein::{halve, subrange, value};
use kilauea_math::Bounds3;

/// Control values by component: of a curve x, y, z and radius, of an oriented one its normal too.
pub(crate) type Components<const C: usize> = [[f64; 4]; C];

/// The part of a curve over `[from, to]`.
#[inline]
pub(crate) fn part<const C: usize>(curve: &Components<C>, [from, to]: [f64; 2]) -> Components<C> {
    if [from, to] == [0.0, 1.0] {
        return *curve;
    }
    curve.map(|c| subrange(&c, from, to))
}

/// Both halves of a curve.
#[inline]
pub(crate) fn halves<const C: usize>(curve: &Components<C>) -> [Components<C>; 2] {
    let mut both = [*curve; 2];
    for (i, c) in curve.iter().enumerate() {
        (both[0][i], both[1][i]) = halve(c);
    }
    both
}

/// The smallest box around the balls along the curve, rounded outwards: in each axis the balls
/// end at coordinate ± radius, both again cubics.
pub(crate) fn bounds(curve: &Components<4>) -> Bounds3 {
    let mut bounds = Bounds3::EMPTY;
    let radius = &curve[3];
    for (axis, center) in curve[..3].iter().enumerate() {
        let low: [f64; 4] = std::array::from_fn(|i| center[i] - radius[i]);
        let high: [f64; 4] = std::array::from_fn(|i| -center[i] - radius[i]);
        bounds.min[axis] = (lowest(&low) as f32).next_down();
        bounds.max[axis] = (-lowest(&high) as f32).next_up();
    }
    bounds
}

/// The least value of a cubic over [0, 1], less what rounding may have added to it.
fn lowest(c: &[f64; 4]) -> f64 {
    let [a, b, d] = [c[1] - c[0], c[2] - c[1], c[3] - c[2]];
    // The derivative is 3 (a (1-u)² + 2 b u (1-u) + d u²).
    let (quadratic, half_linear) = (a - 2.0 * b + d, b - a);
    let mut least = c[0].min(c[3]);
    let discriminant = half_linear * half_linear - quadratic * a;
    if discriminant > 0.0 {
        let q = -(half_linear + discriminant.sqrt().copysign(half_linear));
        for root in [q / quadratic, a / q] {
            if (0.0..=1.0).contains(&root) {
                least = least.min(value(*c, root));
            }
        }
    }
    let size = c.iter().fold(0.0, |size, c| f64::max(size, c.abs()));
    least - 1e-14 * size
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use kilauea_math::DVec3;
    use kilauea_math::hash::{combine, unit_f32};

    /// Numbers in [0, 1) in a fixed order.
    pub(crate) struct Random(pub(crate) u32);

    impl Random {
        pub(crate) fn unit(&mut self) -> f64 {
            self.0 = self.0.wrapping_add(1);
            f64::from(unit_f32(combine(self.0, 31)))
        }

        /// A point of the cube [-1, 1]³.
        pub(crate) fn point(&mut self) -> DVec3 {
            DVec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
        }
    }

    #[test]
    fn bounds_hold_all_balls_and_touch_some() {
        let mut random = Random(5);
        for _ in 0..300 {
            let points = [0; 4].map(|_| random.point());
            let [x, y, z] = [0, 1, 2].map(|axis| points.map(|p| p[axis]));
            let curve = [x, y, z, [0; 4].map(|_| 0.3 * random.unit())];
            let bounds = bounds(&curve);
            let mut sampled = Bounds3::EMPTY;
            for i in 0..=2000 {
                let [x, y, z, r] = curve.map(|c| value(c, f64::from(i) / 2000.0));
                let c = DVec3::new(x, y, z);
                sampled.include((c - r).as_vec3());
                sampled.include((c + r).as_vec3());
            }
            let slack = (bounds.diagonal() - sampled.diagonal()).max_element();
            assert!((0.0..1e-5).contains(&slack), "{slack}");
            assert_eq!(bounds.union(&sampled), bounds);
        }
    }

    #[test]
    fn halves_are_parts() {
        let curve = [[0.0, 1.0, -2.0, 0.5], [1.0; 4]];
        let [left, right] = halves(&curve);
        assert_eq!(left, part(&curve, [0.0, 0.5]));
        assert_eq!(right, part(&curve, [0.5, 1.0]));
        assert_eq!(curve, part(&curve, [0.0, 1.0]));
    }
}
