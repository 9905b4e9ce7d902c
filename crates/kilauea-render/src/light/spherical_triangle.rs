//! Uniform sampling of the solid angle of a triangle, parametrised as by Arvo 1995, "Stratified
//! Sampling of Spherical Triangles".
//!
//! Angles are halved as by van Oosterom & Strackee 1983 and, to sample, by Peters 2021, "BRDF
//! Importance Sampling for Polygonal Lights": nothing is lost to cancellation then, neither close to
//! the plane nor in slivers, and all is in `f64`, so that only the coordinates are rounded.

use kilauea_math::{DVec3, Vec2, Vec3, each_of_three};

/// Squared distance over squared longest edge from which on a triangle is far: distance then varies
/// by less over it.
const FAR: f32 = 1.0;

/// Height above the plane, by the largest coordinate, below which rounded coordinates do not tell on
/// which side of the triangle a point is. Such points are on the triangle itself or beside it.
const MIN_HEIGHT: f64 = 1e-6;

/// A triangle as seen from a point that is near it.
#[derive(Clone, Copy, Debug)]
pub(super) struct SphericalTriangle {
    /// Unit vectors to the corners.
    toward: [DVec3; 3],
    distances: [f64; 3],
    /// Volume of the parallelepiped of `toward`.
    volume: f64,
    /// Cosine of the edge between the first two corners.
    cos_01: f64,
    /// Sum of the cosines of the other two edges.
    cos_02_12: f64,
    solid_angle: f64,
}

/// A point of a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct TrianglePoint {
    /// Weights of the second and third corner.
    pub(super) weights: Vec2,
    /// From where it is seen.
    pub(super) to_point: Vec3,
}

impl SphericalTriangle {
    /// The triangle seen from `p`. None where it is so far that area sampling is as good and
    /// cheaper, or where its solid angle is not known.
    #[inline]
    pub(super) fn new(corners: &[Vec3; 3], p: Vec3) -> Option<Self> {
        let [a, b, c] = *corners;
        let longest_sq = (b - a)
            .length_squared()
            .max((c - b).length_squared())
            .max((a - c).length_squared());
        let to_center = (a + b + c) / 3.0 - p;
        if to_center.length_squared() > FAR * longest_sq {
            return None;
        }
        Self::near(corners, p)
    }

    fn near(corners: &[Vec3; 3], p: Vec3) -> Option<Self> {
        let to_corners = each_of_three(*corners, |corner| corner.as_dvec3() - p.as_dvec3());
        let [a, b, c] = to_corners;
        let normal = (b - a).cross(c - a);
        let volume = normal.dot(a).abs();
        let reach = corners.iter().fold(p.abs(), |reach, q| reach.max(q.abs()));
        let least_height = MIN_HEIGHT * f64::from(reach.max_element());
        if volume.is_nan() || volume <= least_height * normal.length() {
            return None;
        }
        let distances = each_of_three(to_corners, DVec3::length);
        let toward = each_of_three([0, 1, 2], |i| to_corners[i] / distances[i]);
        let volume = volume / (distances[0] * distances[1] * distances[2]);
        let cos_01 = toward[0].dot(toward[1]);
        let cos_02_12 = (toward[0] + toward[1]).dot(toward[2]);
        let solid_angle = 2.0 * volume.atan2(1.0 + cos_01 + cos_02_12);
        (solid_angle > 0.0).then_some(Self {
            toward,
            distances,
            volume,
            cos_01,
            cos_02_12,
            solid_angle,
        })
    }

    /// Density per solid angle.
    #[inline]
    pub(super) fn pdf(&self) -> f32 {
        (1.0 / self.solid_angle) as f32
    }

    /// A point in a direction that is uniform in the solid angle.
    #[inline]
    pub(super) fn sample(&self, u: Vec2) -> TrianglePoint {
        let u = u.as_dvec2();
        let [first, second, third] = self.toward;
        // A point on the edge from the first corner to the third cuts off a triangle of this half
        // solid angle: with it in place of the third corner, tan(ω/2) has the point's mirror axis,
        // half way from the first corner, in both its terms, and is a linear equation for that.
        let (sin, cos) = (0.5 * u.x * self.solid_angle).sin_cos();
        let (axis_0, axis_2) = (
            self.volume * cos - self.cos_02_12 * sin,
            (1.0 + self.cos_01) * sin,
        );
        let axis = axis_0 * first + axis_2 * third;
        let reflect = 2.0 * axis.dot(first) / axis.length_squared();
        let (cut_0, cut_2) = (reflect * axis_0 - 1.0, reflect * axis_2);
        let cut = cut_0 * first + cut_2 * third;
        // On the arc from the second corner to that point the height of the cap around the corner,
        // 1 − cos, is uniform.
        let cap = 0.5 * cut.distance_squared(second);
        let along = (u.y * (2.0 - u.y * cap) / (2.0 - cap)).sqrt();
        let of_directions = [
            along * cut_0,
            1.0 - u.y * cap - along * (1.0 - cap),
            along * cut_2,
        ];
        // The direction is a sum of those to the corners, so the point is one of the corners.
        let of_corners =
            each_of_three([0, 1, 2], |i| of_directions[i].max(0.0) / self.distances[i]);
        let sum: f64 = of_corners.iter().sum();
        let [w0, w1, w2] = each_of_three(of_corners, |w| w / sum);
        let [d0, d1, d2] = self.distances;
        TrianglePoint {
            weights: Vec2::new(w1 as f32, w2 as f32),
            to_point: (w0 * d0 * first + w1 * d1 * second + w2 * d2 * third).as_vec3(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    /// Triangles with points that see them, at many scales.
    fn cases() -> Vec<([Vec3; 3], Vec3)> {
        let triangle = |a, b, c| [a, b, c].map(Vec3::from_array);
        let lamp = triangle([-0.6, -0.3, 0.0], [0.5, -0.4, 0.1], [0.1, 0.6, 0.0]);
        let sliver = triangle([0.0, -0.9, 0.0], [1e-5, 0.8, 0.0], [0.0, 0.7, 1e-6]);
        let flat = triangle([-1.0, 0.0, 0.0], [0.1, 1e-4, 0.0], [1.0, 0.0, 0.0]);
        let near = [
            (lamp, Vec3::new(0.1, -0.1, 0.3)),
            (lamp, Vec3::new(0.1, -0.1, -0.01)),
            (lamp, Vec3::new(0.0, 0.0, 0.0101)),
            (lamp, Vec3::new(0.52, -0.41, 0.1)),
            (lamp, Vec3::new(-0.8, 0.7, 0.002)),
            (sliver, Vec3::new(0.05, 0.1, 0.1)),
            (sliver, Vec3::new(-1e-3, 0.1, 1e-3)),
            (flat, Vec3::new(0.2, 0.3, 0.01)),
            (flat, Vec3::new(0.1, 0.0, 1e-3)),
        ];
        let scaled = |scale: f32| {
            let of_case = move |(triangle, p): ([Vec3; 3], Vec3)| {
                (triangle.map(|corner| scale * corner), scale * p)
            };
            near.into_iter().map(of_case)
        };
        // Millimetres, metres, light years, and the ends of what numbers can hold.
        [1e-15, 1e-3, 1.0, 1e16, 1e30]
            .into_iter()
            .flat_map(scaled)
            .collect()
    }

    fn near(corners: &[Vec3; 3], p: Vec3) -> SphericalTriangle {
        SphericalTriangle::new(corners, p).unwrap_or_else(|| panic!("{corners:?} from {p}"))
    }

    /// Solid angle by the spherical excess of L'Huilier: nothing in common with the code but `f64`.
    fn lhuilier(corners: [DVec3; 3], p: DVec3) -> f64 {
        let toward = corners.map(|corner| (corner - p).normalize());
        // Twice the arc sine of half the chord keeps the digits of short edges.
        let edge = |i: usize, j: usize| 2.0 * (0.5 * toward[i].distance(toward[j])).asin();
        let [a, b, c] = [edge(1, 2), edge(2, 0), edge(0, 1)];
        let half = 0.5 * (a + b + c);
        let product: f64 = [half, half - a, half - b, half - c]
            .into_iter()
            .map(|angle| (0.5 * angle).tan())
            .product();
        4.0 * product.max(0.0).sqrt().atan()
    }

    #[test]
    fn an_octant_is_an_eighth_of_the_sphere() {
        let octant = near(&[Vec3::X, Vec3::Y, Vec3::Z], Vec3::ZERO);
        assert!((octant.solid_angle - FRAC_PI_2).abs() < 1e-12);
        assert!((octant.pdf() * std::f32::consts::FRAC_PI_2 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn close_by_a_triangle_fills_half_of_what_is_seen() {
        let (triangle, _) = cases()[18];
        let center = triangle.iter().sum::<Vec3>() / 3.0;
        let solid_angle = near(&triangle, center + Vec3::new(0.0, 0.0, 1e-5)).solid_angle;
        assert!(
            (solid_angle / (2.0 * PI) - 1.0).abs() < 1e-3,
            "{solid_angle}"
        );
    }

    #[test]
    fn solid_angles_are_those_of_lhuilier() {
        for (triangle, p) in cases() {
            let found = near(&triangle, p).solid_angle;
            let expected = lhuilier(triangle.map(Vec3::as_dvec3), p.as_dvec3());
            // Half the circumference less an edge cancels in slivers, not in the code.
            let error = (found - expected).abs();
            assert!(
                error < 1e-6 * expected + 1e-9,
                "{triangle:?} {p}: {found} {expected}"
            );
        }
    }

    #[test]
    fn points_are_on_the_triangle_where_their_weights_say() {
        for (triangle, p) in cases() {
            let near = near(&triangle, p);
            let [a, b, c] = triangle.map(Vec3::as_dvec3);
            let size = (b - a).length().max((c - a).length());
            for i in 0..1000_u16 {
                let u = Vec2::new(f32::from(i % 25) / 24.0, f32::from(i / 25) / 39.0);
                let TrianglePoint { weights, to_point } =
                    near.sample(u.min(Vec2::splat(0.999_999_9)));
                let [second, third] = weights.as_dvec2().to_array();
                assert!(second >= 0.0 && third >= 0.0 && second + third < 1.0 + 1e-6);
                let q = a + second * (b - a) + third * (c - a);
                let error = (p.as_dvec3() + to_point.as_dvec3() - q).length();
                assert!(error < 1e-6 * size, "{triangle:?} {p} {u}: {error}");
            }
        }
    }

    /// Points fall into either part of a triangle as often as its share of the solid angle says.
    #[test]
    fn points_are_even_in_the_solid_angle() {
        for (triangle, p) in cases() {
            let near = near(&triangle, p);
            let exact = triangle.map(Vec3::as_dvec3);
            let n = 200;
            for corner in 0..3 {
                let [first, second, third] = [0, 1, 2].map(|i| exact[(corner + i) % 3]);
                let cut = 0.7 * second + 0.3 * third;
                let expected =
                    lhuilier([first, second, cut], p.as_dvec3()) / lhuilier(exact, p.as_dvec3());
                let mut n_inside = 0;
                for i in 0..n * n {
                    let u = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32;
                    let [w1, w2] = near.sample(u).weights.as_dvec2().to_array();
                    let weights = [1.0 - w1 - w2, w1, w2];
                    let [second, third] = [1, 2].map(|i| weights[(corner + i) % 3]);
                    n_inside += u32::from(0.7 * third < 0.3 * second);
                }
                let share = f64::from(n_inside) / f64::from(n * n);
                assert!(
                    (share - expected).abs() < 0.01,
                    "{triangle:?} {p}: {share} {expected}"
                );
            }
        }
    }

    #[test]
    fn what_is_far_flat_or_no_number_is_not_near() {
        let (triangle, p) = cases()[18];
        let [a, b, c] = triangle;
        let center = (a + b + c) / 3.0;
        let is_near = |triangle: [Vec3; 3], p| SphericalTriangle::new(&triangle, p).is_some();
        assert!(is_near(triangle, p));
        assert!(!is_near(triangle, 100.0 * p), "far");
        assert!(!is_near(triangle, center), "on it");
        assert!(!is_near(triangle, a), "at its corner");
        assert!(!is_near(triangle, a + 1.2 * (b - a)), "in its plane");
        assert!(
            !is_near([Vec3::ZERO, Vec3::X, 0.5 * Vec3::X], p),
            "without area"
        );
        assert!(!is_near([a, a, a], a), "a point");
        assert!(!is_near([a, b, Vec3::NAN], p));
        assert!(!is_near([a, b, Vec3::INFINITY], p));
        assert!(!is_near(triangle, Vec3::splat(f32::NAN)));
        // Where rounded coordinates are coarser than the distance.
        let away = Vec3::splat(1e6);
        assert!(!is_near(
            triangle.map(|corner| corner + away),
            center + away + 0.01
        ));
    }
}
