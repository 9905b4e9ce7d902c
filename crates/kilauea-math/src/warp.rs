//! Maps from the unit square to other domains, each with its density.
//!
//! Every density is with respect to solid angle or area as its doc says; `u` is in [0, 1)².

use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_PI_4, PI, TAU};

use crate::INV_PI;

/// Area-preserving map to the unit disk (Shirley & Chiu 1997); density 1/pi per area.
#[inline]
pub fn concentric_disk(u: Vec2) -> Vec2 {
    let o = 2.0 * u - Vec2::ONE;
    if o == Vec2::ZERO {
        return Vec2::ZERO;
    }
    // Which is the longer one cannot be guessed, so it decides no jump.
    let is_x_longer = o.x.abs() > o.y.abs();
    let (long, short) = if is_x_longer { (o.x, o.y) } else { (o.y, o.x) };
    let (sin, cos) = sin_cos_octant(FRAC_PI_4 * (short / long));
    let (along, across) = (long * cos, long * sin);
    if is_x_longer {
        Vec2::new(along, across)
    } else {
        Vec2::new(across, along)
    }
}

/// Sine and cosine within ±pi/4, by Taylor series that are exact to a rounding there.
#[inline]
fn sin_cos_octant(x: f32) -> (f32, f32) {
    let x2 = x * x;
    let sin =
        x * (1.0 + x2 * (-1.0 / 6.0 + x2 * (1.0 / 120.0 + x2 * (-1.0 / 5040.0 + x2 / 362880.0))));
    let cos = 1.0 + x2 * (-0.5 + x2 * (1.0 / 24.0 + x2 * (-1.0 / 720.0 + x2 / 40320.0)));
    (sin, cos)
}

/// Directions around +z with density cos(theta)/pi per solid angle.
#[inline]
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let d = concentric_disk(u);
    d.extend((1.0 - d.length_squared()).max(0.0).sqrt())
}

/// Density of [`cosine_hemisphere`] per solid angle.
#[inline]
pub fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    cos_theta.max(0.0) * INV_PI
}

/// Directions with density 1/(4 pi) per solid angle.
#[inline]
pub fn uniform_sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (TAU * u.y).sin_cos();
    Vec3::new(r * cos, r * sin, z)
}

/// Directions within an angle of +z, uniform per solid angle; `one_minus_cos_max` = 1 − cos(angle).
#[inline]
pub fn uniform_cone(u: Vec2, one_minus_cos_max: f32) -> Vec3 {
    let one_minus_cos = u.x * one_minus_cos_max;
    let sin_theta = (one_minus_cos * (2.0 - one_minus_cos)).max(0.0).sqrt();
    let (sin, cos) = (TAU * u.y).sin_cos();
    Vec3::new(sin_theta * cos, sin_theta * sin, 1.0 - one_minus_cos)
}

/// Density of [`uniform_cone`] per solid angle.
#[inline]
pub fn uniform_cone_pdf(one_minus_cos_max: f32) -> f32 {
    1.0 / (2.0 * PI * one_minus_cos_max)
}

/// Barycentric weights of the second and third vertex, uniform per area (Heitz 2019).
#[inline]
pub fn uniform_triangle(u: Vec2) -> Vec2 {
    if u.x < u.y {
        let b0 = 0.5 * u.x;
        Vec2::new(b0, u.y - b0)
    } else {
        let b1 = 0.5 * u.y;
        Vec2::new(u.x - b1, b1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::{mix32, unit_f32};

    fn square(i: u32) -> Vec2 {
        Vec2::new(unit_f32(mix32(2 * i + 1)), unit_f32(mix32(2 * i + 2)))
    }

    #[test]
    fn cosine_hemisphere_has_mean_cosine_two_thirds() {
        let n = 200_000;
        let mean = (0..n)
            .map(|i| cosine_hemisphere(square(i)).z as f64)
            .sum::<f64>()
            / n as f64;
        assert!((mean - 2.0 / 3.0).abs() < 2e-3, "{mean}");
    }

    #[test]
    fn series_agree_with_the_functions() {
        for i in -1000..=1000 {
            let x = FRAC_PI_4 * i as f32 / 1000.0;
            let (sin, cos) = sin_cos_octant(x);
            assert!(
                (sin - x.sin()).abs() < 1.2e-7 && (cos - x.cos()).abs() < 1.2e-7,
                "{x}"
            );
        }
    }

    #[test]
    fn directions_are_unit() {
        for i in 0..1000 {
            for w in [
                cosine_hemisphere(square(i)),
                uniform_sphere(square(i)),
                uniform_cone(square(i), 1e-3),
            ] {
                assert!((w.length() - 1.0).abs() < 1e-5, "{w}");
            }
        }
    }

    #[test]
    fn triangle_weights_stay_inside_and_average_a_third() {
        let n = 100_000;
        let mut mean = Vec2::ZERO;
        for i in 0..n {
            let b = uniform_triangle(square(i));
            assert!(b.x >= 0.0 && b.y >= 0.0 && b.x + b.y <= 1.0 + 1e-6);
            mean += b / n as f32;
        }
        assert!(
            (mean - Vec2::splat(1.0 / 3.0)).abs().max_element() < 3e-3,
            "{mean}"
        );
    }
}
