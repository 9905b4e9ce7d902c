//! The octahedral map between directions and the unit square (Meyer et al. 2010, "On Floating-Point
//! Normal Vectors"): projection onto the octahedron |x| + |y| + |z| = 1, lower half folded outward.

use crate::{Vec2, Vec3};

/// Where a unit vector lies in [0, 1]².
#[inline]
pub fn square_from_direction(d: Vec3) -> Vec2 {
    let q = d.truncate() / l1_norm(d);
    let folded = if d.z >= 0.0 { q } else { fold(q) };
    0.5 * folded + 0.5
}

/// The unit vector at a point of [0, 1]².
#[inline]
pub fn direction_from_square(s: Vec2) -> Vec3 {
    let q = 2.0 * s - 1.0;
    let z = 1.0 - q.x.abs() - q.y.abs();
    let q = if z >= 0.0 { q } else { fold(q) };
    q.extend(z).normalize()
}

/// Solid angle per area of the square around a unit vector. A face lies in the plane
/// x + y + z = 1, so that dω = dx dy / r³, with r = 1 / |d|₁ the distance to the face along `d`;
/// the square has a quarter of the area of [−1, 1]².
#[inline]
pub fn solid_angle_per_area(d: Vec3) -> f32 {
    let norm = l1_norm(d);
    4.0 * norm * norm * norm
}

#[inline]
fn l1_norm(d: Vec3) -> f32 {
    d.abs().element_sum()
}

/// Mirrors each quadrant at its diagonal, which swaps the halves of the octahedron.
#[inline]
fn fold(q: Vec2) -> Vec2 {
    let mirrored = 1.0 - Vec2::new(q.y.abs(), q.x.abs());
    mirrored * Vec2::new(1.0_f32.copysign(q.x), 1.0_f32.copysign(q.y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const SIDE: usize = 256;

    fn centers() -> impl Iterator<Item = Vec2> {
        let at = |i: usize| (i as f32 + 0.5) / SIDE as f32;
        (0..SIDE * SIDE).map(move |i| Vec2::new(at(i % SIDE), at(i / SIDE)))
    }

    #[test]
    fn the_map_is_undone() {
        for s in centers() {
            let d = direction_from_square(s);
            assert!((d.length() - 1.0).abs() < 1e-6);
            assert!(square_from_direction(d).distance(s) < 1e-6, "{s}");
        }
        for axis in Vec3::AXES.into_iter().chain(Vec3::AXES.map(|a| -a)) {
            let back = direction_from_square(square_from_direction(axis));
            assert!(back.distance(axis) < 1e-6, "{axis}");
        }
    }

    #[test]
    fn solid_angles_add_up_to_the_sphere_and_its_moments() {
        let area = 1.0 / (SIDE * SIDE) as f64;
        let (mut total, mut z_sq) = (0.0, 0.0);
        for s in centers() {
            let d = direction_from_square(s);
            let solid_angle = f64::from(solid_angle_per_area(d)) * area;
            total += solid_angle;
            z_sq += solid_angle * f64::from(d.z * d.z);
        }
        assert!((total / (4.0 * PI) - 1.0).abs() < 1e-4, "{total}");
        assert!((z_sq / (4.0 * PI / 3.0) - 1.0).abs() < 1e-4, "{z_sq}");
    }
}
