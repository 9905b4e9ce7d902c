//! Uniform sampling of the solid angle of a rectangle
//! (Ureña, Fajardo & King 2013, "An Area-Preserving Parametrization for Spherical Rectangles").

use kilauea_math::{Vec2, Vec3, hypot};

/// Squared distance over squared diagonal from which on a rectangle is far: cosine and distance
/// then vary by little over it.
const FAR: f32 = 4.0;

/// A rectangle.
#[derive(Clone, Debug)]
pub(super) struct Rectangle {
    corner: Vec3,
    center: Vec3,
    /// Unit vectors along the edges, and across both.
    x: Vec3,
    y: Vec3,
    z: Vec3,
    /// Of the edges.
    lengths: [f32; 2],
    /// Squared distance from which on it is far.
    far_sq: f32,
}

/// A rectangle as seen from a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct SphericalRect<'a> {
    rectangle: &'a Rectangle,
    origin: Vec3,
    z: Vec3,
    x0: f32,
    x1: f32,
    y0: f32,
    y1: f32,
    z0: f32,
    solid_angle: f32,
}

impl Rectangle {
    /// The rectangle `corner + [0, 1] edge_x + [0, 1] edge_y` with perpendicular edges.
    pub(super) fn new(corner: Vec3, edge_x: Vec3, edge_y: Vec3) -> Self {
        let (length_x, length_y) = (edge_x.length(), edge_y.length());
        let (x, y) = (edge_x / length_x, edge_y / length_y);
        Self {
            corner,
            center: corner + 0.5 * (edge_x + edge_y),
            x,
            y,
            z: x.cross(y),
            lengths: [length_x, length_y],
            far_sq: FAR * (edge_x.length_squared() + edge_y.length_squared()),
        }
    }

    /// As seen from `p`. None where it is so far that area sampling is as good, cheaper, and rounds
    /// better.
    #[inline]
    pub(super) fn seen_from(&self, p: Vec3) -> Option<SphericalRect<'_>> {
        if self.center.distance_squared(p) > self.far_sq {
            return None;
        }
        let to_corner = self.corner - p;
        let mut z = self.z;
        let mut z0 = to_corner.dot(z);
        if z0 > 0.0 {
            z = -z;
            z0 = -z0;
        }
        let [length_x, length_y] = self.lengths;
        let (x0, y0) = (to_corner.dot(self.x), to_corner.dot(self.y));
        let (x1, y1) = (x0 + length_x, y0 + length_y);
        let solid_angle = solid_angle([x0, x1], [y0, y1], z0);
        (solid_angle > 1e-4 && z0 < 0.0).then_some(SphericalRect {
            rectangle: self,
            origin: p,
            z,
            x0,
            x1,
            y0,
            y1,
            z0,
            solid_angle,
        })
    }
}

impl SphericalRect<'_> {
    /// Density per solid angle.
    pub(super) fn pdf(&self) -> f32 {
        1.0 / self.solid_angle
    }

    /// A point of the rectangle.
    #[inline]
    pub(super) fn sample(&self, u: Vec2) -> Vec3 {
        // Normals of the four planes through the origin and an edge; only these components are not
        // zero, and one of them is not needed.
        let normal_z = |at: f32| at / hypot(at, self.z0);
        let (n0, n2, n3) = (-normal_z(self.y0), normal_z(self.y1), -normal_z(self.x0));
        let angle = |a: f32, b: f32| (-a * b).clamp(-1.0, 1.0).acos();
        let k = 2.0 * std::f32::consts::PI - angle(n2, n3) - angle(n3, n0);
        let phi = u.x * self.solid_angle + k;
        let (sin_phi, cos_phi) = phi.sin_cos();
        let fu = (cos_phi * n0 - n2) / sin_phi;
        let cu = (1.0 / (fu * fu + n0 * n0).sqrt())
            .copysign(fu)
            .clamp(-1.0, 1.0);
        let sin_cu = (1.0 - cu * cu).max(1e-12).sqrt();
        let xu = (-(cu * self.z0) / sin_cu).clamp(self.x0, self.x1);
        let d = hypot(xu, self.z0);
        let sine = |y: f32| y / hypot(d, y);
        let (h0, h1) = (sine(self.y0), sine(self.y1));
        let hv = h0 + u.y * (h1 - h0);
        let hv_sq = hv * hv;
        let yv = if hv_sq < 1.0 - 1e-6 {
            hv * d / (1.0 - hv_sq).sqrt()
        } else {
            self.y1
        };
        let (x, y) = (self.rectangle.x, self.rectangle.y);
        self.origin + xu * x + yv.clamp(self.y0, self.y1) * y + self.z0 * self.z
    }
}

/// Solid angle of the rectangle between two x and two y in the plane `z` (van Oosterom & Strackee
/// 1983, for its two triangles). Four angles less 2π, as in Ureña et al., would lose all digits of
/// a rectangle seen from close to its plane, and the light sampled with it would be off as much.
fn solid_angle([x0, x1]: [f32; 2], [y0, y1]: [f32; 2], z: f32) -> f32 {
    let corner = |x, y| Vec3::new(x, y, z);
    let corners = [
        corner(x0, y0),
        corner(x1, y0),
        corner(x1, y1),
        corner(x0, y1),
    ];
    let [a, b, c, d] = &corners;
    let lengths = [a.length(), b.length(), c.length(), d.length()];
    let determinant = (z * (x1 - x0) * (y1 - y0)).abs();
    let triangle = |i: usize, j: usize, k: usize| {
        let dots = corners[i].dot(corners[j]) * lengths[k]
            + corners[j].dot(corners[k]) * lengths[i]
            + corners[k].dot(corners[i]) * lengths[j];
        2.0 * determinant.atan2(lengths[i] * lengths[j] * lengths[k] + dots)
    };
    triangle(0, 1, 2) + triangle(0, 2, 3)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the four-angle formula in `f64`.
    #[test]
    fn solid_angle_keeps_its_digits_close_to_the_plane() {
        for z in [-1.0, -0.1, -1e-2, -1e-3] {
            let (x, y) = ([0.2_f32, 0.7], [-0.1_f32, 0.3]);
            let sine = |at: f32| f64::from(at) / f64::from(at).hypot(f64::from(z));
            let n = [-sine(y[0]), sine(x[1]), sine(y[1]), -sine(x[0])];
            let angles = (0..4).map(|i| (-n[i] * n[(i + 1) % 4]).acos());
            let expected = angles.sum::<f64>() - 2.0 * std::f64::consts::PI;
            let error = f64::from(solid_angle(x, y, z)) / expected - 1.0;
            assert!(error.abs() < 2e-6, "{z}: {error}");
        }
    }

    #[test]
    fn solid_angle_is_that_of_a_cube_face() {
        let r = Rectangle::new(Vec3::new(-1.0, -1.0, -1.0), 2.0 * Vec3::X, 2.0 * Vec3::Y);
        let pdf = r.seen_from(Vec3::ZERO).unwrap().pdf();
        assert!((1.0 / pdf - 4.0 * std::f32::consts::PI / 6.0).abs() < 1e-5);
    }

    #[test]
    fn samples_are_uniform_per_solid_angle() {
        // The mean of cos/pdf over the rectangle is the form factor times pi.
        let r = Rectangle::new(Vec3::new(-0.4, -0.3, -1.0), Vec3::X, 1.3 * Vec3::Y);
        let r = r.seen_from(Vec3::ZERO).unwrap();
        let n = 256;
        let mut by_solid_angle = 0.0_f64;
        let mut by_area = 0.0_f64;
        for i in 0..n * n {
            let u = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32;
            let q = r.sample(u);
            by_solid_angle += (-q.z / q.length() / r.pdf()) as f64;
            let q = Vec3::new(-0.4 + u.x, -0.3 + 1.3 * u.y, -1.0);
            by_area += (1.3 / q.length().powi(4)) as f64;
        }
        assert!(
            (by_solid_angle / by_area - 1.0).abs() < 1e-3,
            "{by_solid_angle} {by_area}"
        );
    }
}
