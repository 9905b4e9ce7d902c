use kilauea_math::{Vec2, Vec3};

use crate::Surface;

/// Sine of the least angle between a shading normal, or a mirror direction, and the surface.
const MIN_SIN: f32 = 0.01;

impl Surface<'_> {
    /// The shading normal that a normal map gives: `n_tangent` in tangent space (x along s, y along
    /// t, z along `ns`), with the map's texture coordinates at the triangle's corners.
    ///
    /// Stays on the outside of the mesh; is `ns` where the coordinates span no area.
    pub fn mapped_normal(&self, n_tangent: Vec3, st: [Vec2; 3]) -> Vec3 {
        let [a, b, c] = self.corners;
        let (p1, p2) = (b - a, c - a);
        let (st1, st2) = (st[1] - st[0], st[2] - st[0]);
        let det = st1.perp_dot(st2);
        let dp_ds = (st2.y * p1 - st1.y * p2) * det.signum();
        let tangent = dp_ds - dp_ds.dot(self.ns) * self.ns;
        let (Some(tangent), true) = (tangent.try_normalize(), det != 0.0 && det.is_finite()) else {
            return self.ns;
        };
        // Mirrored coordinates mirror the basis.
        let bitangent = self.ns.cross(tangent) * det.signum();
        let n = n_tangent.x * tangent + n_tangent.y * bitangent + n_tangent.z * self.ns;
        let Some(n) = n.try_normalize() else {
            return self.ns;
        };
        lifted(n, self.ng)
    }

    /// The normal nearest to `ns` whose mirror direction of `wo` does not dive into the surface,
    /// on the side of `ng` (after Keller et al. 2017, "The Iray Light Transport Simulation and
    /// Rendering System", A.3).
    ///
    /// Without it the silhouettes of glossy meshes and steep normal maps are black.
    pub fn reflecting_normal(&self, ns: Vec3) -> Vec3 {
        let side = if self.ng.dot(self.wo) < 0.0 {
            -1.0
        } else {
            1.0
        };
        let (ng, n) = (side * self.ng, side * ns);
        let mirrored = 2.0 * self.wo.dot(n) * n - self.wo;
        if mirrored.dot(ng) >= MIN_SIN.min(self.wo.dot(ng)) {
            return ns;
        }
        let above = lifted(mirrored, ng);
        (self.wo + above).try_normalize().map_or(ns, |n| side * n)
    }
}

/// A unit vector, turned toward `ng` until it is just above the surface.
fn lifted(v: Vec3, ng: Vec3) -> Vec3 {
    let sin = v.dot(ng);
    if sin >= MIN_SIN {
        v
    } else {
        (v + (MIN_SIN - sin) * ng).normalize_or(ng)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Fixture;

    #[test]
    fn flat_map_keeps_the_normal() {
        let fixture = Fixture::tilted_triangle();
        let s = fixture.surface();
        let st = [Vec2::ZERO, Vec2::X, Vec2::Y];
        assert!(s.mapped_normal(Vec3::Z, st).distance(s.ns) < 1e-6);
    }

    #[test]
    fn tangents_follow_the_texture_on_a_tilted_triangle() {
        let fixture = Fixture::tilted_triangle();
        let s = fixture.surface();
        let [a, b, c] = s.corners;
        let (e1, e2) = ((b - a).normalize(), (c - a).normalize());
        let check = |st: [Vec2; 3], n_tangent: Vec3, expected: Vec3| {
            let found = s.mapped_normal(n_tangent, st);
            let expected = expected.normalize();
            assert!(found.distance(expected) < 1e-5, "{found} {expected}");
        };
        let tilt = Vec3::new(0.6, 0.0, 0.8);
        let tilt_t = Vec3::new(0.0, 0.6, 0.8);
        // s along the first edge, t along the second; the edges are perpendicular.
        let st = [Vec2::ZERO, Vec2::X, Vec2::Y];
        check(st, tilt, 0.6 * e1 + 0.8 * s.ns);
        check(st, tilt_t, 0.6 * e2 + 0.8 * s.ns);
        // s and t exchanged: mirrored.
        let st = [Vec2::ZERO, Vec2::Y, Vec2::X];
        check(st, tilt, 0.6 * e2 + 0.8 * s.ns);
        check(st, tilt_t, 0.6 * e1 + 0.8 * s.ns);
        // No coordinates to speak of.
        check([Vec2::ONE; 3], tilt, s.ns);
        // Never to the inside.
        let st = [Vec2::ZERO, Vec2::X, Vec2::Y];
        assert!(s.mapped_normal(Vec3::new(1.0, 0.0, -0.5), st).dot(s.ng) > 0.0);
    }

    #[test]
    fn mirror_directions_stay_above_the_surface() {
        let fixture = Fixture::tilted_triangle();
        for i in 0..200_u32 {
            let mut s = fixture.surface();
            let random = |k: u32| {
                let u = [3 * i + k, 1000 + 3 * i + k]
                    .map(|x| kilauea_math::hash::unit_f32(kilauea_math::hash::mix32(x)));
                kilauea_math::warp::uniform_sphere(u.into())
            };
            s.wo = random(0);
            let ns = (s.ng + 0.8 * random(1)).normalize();
            let n = s.reflecting_normal(ns);
            let mirrored = 2.0 * s.wo.dot(n) * n - s.wo;
            assert!(mirrored.dot(s.ng) * s.wo.dot(s.ng) > 0.0);
            assert!(n.dot(s.ng) > 0.0 && (n.length() - 1.0).abs() < 1e-5);
        }
    }
}
