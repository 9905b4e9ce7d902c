use std::f64::consts::TAU;

use kilauea_math::{DVec3, Vec3};

use crate::Domain;

/// The unit sphere in polar coordinates about an axis, with more of the chart near it.
///
/// Where the chart has coordinates (u, v), 1 − cos θ = 2 u^k and φ = 2π v.
#[derive(Clone, Copy, Debug)]
pub struct Directions {
    axes: [DVec3; 3],
    /// A whole number, so that the chart is smooth.
    exponent: i32,
}

impl Directions {
    /// About half of the chart is within `half_angle` (radians, up to a right angle) of the axis.
    pub fn around(axis: Vec3, half_angle: f64) -> Self {
        let z = axis.as_dvec3().normalize();
        let (x, y) = z.any_orthonormal_pair();
        let one_minus_cos = 2.0 * (0.5 * half_angle).sin().powi(2);
        Self {
            axes: [x, y, z],
            exponent: (0.5 * one_minus_cos).log(0.5).round().max(1.0) as i32,
        }
    }
}

impl Domain for Directions {
    type Point = Vec3;

    fn point(&self, [u, v]: [f64; 2]) -> (Vec3, f64) {
        let k = self.exponent;
        let one_minus_cos = 2.0 * u.powi(k);
        let sin_theta = (one_minus_cos * (2.0 - one_minus_cos)).max(0.0).sqrt();
        let (sin_phi, cos_phi) = (TAU * v).sin_cos();
        let [x, y, z] = self.axes;
        let point =
            x * (sin_theta * cos_phi) + y * (sin_theta * sin_phi) + z * (1.0 - one_minus_cos);
        (point.as_vec3(), TAU * 2.0 * f64::from(k) * u.powi(k - 1))
    }

    fn coordinates(&self, point: Vec3) -> Option<[f64; 2]> {
        let point = point.as_dvec3().normalize_or_zero();
        let [x, y, z] = self.axes;
        // |a − b|² / 2 = 1 − cos, without cancellation near the axis.
        let one_minus_cos = 0.5 * point.distance_squared(z);
        let u = (0.5 * one_minus_cos)
            .min(1.0)
            .powf(1.0 / f64::from(self.exponent));
        let v = (point.dot(y).atan2(point.dot(x)) / TAU).rem_euclid(1.0);
        (point != DVec3::ZERO).then_some([u, v])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{integrate, uniforms};
    use kilauea_math::warp;

    #[test]
    fn points_and_coordinates_agree() {
        for (i, half_angle) in [1e-3, 0.1, 1.5].into_iter().enumerate() {
            let [a, b] = uniforms(9, i as u32);
            let axis = warp::uniform_sphere(kilauea_math::Vec2::new(a, b));
            let domain = Directions::around(axis, half_angle);
            for at in [[0.5, 0.2], [0.3, 0.7], [0.9, 0.99]] {
                let (point, _) = domain.point(at);
                let found = domain.coordinates(point).unwrap();
                for k in 0..2 {
                    assert!((found[k] - at[k]).abs() < 1e-3, "{half_angle}: {found:?}");
                }
            }
            let (rim, _) = domain.point([0.5, 0.0]);
            let angle = f64::from(rim.distance(axis));
            assert!(
                (angle / half_angle - 1.0).abs() < 0.3,
                "{angle} {half_angle}"
            );
            assert_eq!(domain.coordinates(Vec3::ZERO), None);
        }
    }

    #[test]
    fn the_measure_is_solid_angle() {
        for half_angle in [0.01, 0.3, 1.5] {
            let domain = Directions::around(Vec3::new(0.6, 0.0, -0.8), half_angle);
            let mut cos_sq = |at| {
                let (point, measure) = domain.point(at);
                f64::from(point.x).powi(2) * measure
            };
            // In two parts that have no symmetry.
            let found = integrate([0.0, 0.0], [1.0, 0.3], 1e-6, &mut cos_sq)
                + integrate([0.0, 0.3], [1.0, 1.0], 1e-6, &mut cos_sq);
            assert!((found - 2.0 / 3.0 * TAU).abs() < 1e-4, "{found}");
        }
    }
}
