use kilauea_math::{DVec2, Vec3};

/// Splits polygons into triangles of local corner numbers; its buffers are kept between calls.
#[derive(Default)]
pub(crate) struct Triangulator {
    projected: Vec<DVec2>,
    /// Corners not yet cut off.
    remaining: Vec<u32>,
    triangles: Vec<[u32; 3]>,
}

impl Triangulator {
    /// `n - 2` triangles over the corners of a polygon, wound as the polygon is.
    pub(crate) fn triangulate(&mut self, points: &[Vec3]) -> &[[u32; 3]] {
        self.triangles.clear();
        match *points {
            [] | [_] | [_, _] => {}
            [_, _, _] => self.triangles.push([0, 1, 2]),
            [a, b, c, d] => self.triangles.extend(split_quad([a, b, c, d])),
            _ => self.clip_ears(points),
        }
        &self.triangles
    }

    /// Ear clipping (Meisters 1975) in the plane of the polygon's mean normal. A polygon that has
    /// no ear, because it crosses itself, loses its next corner instead.
    fn clip_ears(&mut self, points: &[Vec3]) {
        self.project(points);
        self.remaining.clear();
        self.remaining.extend(0..points.len() as u32);
        let mut at = 0;
        let mut n_refused = 0;
        while self.remaining.len() > 3 {
            let n = self.remaining.len();
            at %= n;
            let ear = [(at + n - 1) % n, at, (at + 1) % n].map(|i| self.remaining[i]);
            if n_refused >= n || self.is_ear(ear) {
                self.triangles.push(ear);
                self.remaining.remove(at);
                n_refused = 0;
            } else {
                n_refused += 1;
            }
            // Going on around the polygon gives fatter triangles than starting over.
            at += 1;
        }
        self.triangles
            .push([self.remaining[0], self.remaining[1], self.remaining[2]]);
    }

    /// Drops the dominant axis of Newell's normal, so that the polygon is counter-clockwise.
    fn project(&mut self, points: &[Vec3]) {
        let origin = points[0].as_dvec3();
        let normal = (0..points.len())
            .map(|i| {
                let a = points[i].as_dvec3() - origin;
                a.cross(points[(i + 1) % points.len()].as_dvec3() - origin)
            })
            .fold(kilauea_math::DVec3::ZERO, |sum, n| sum + n);
        let magnitude = normal.abs();
        self.projected.clear();
        self.projected.extend(points.iter().map(|p| {
            let p = p.as_dvec3() - origin;
            let (uv, sign) = if magnitude.x >= magnitude.y && magnitude.x >= magnitude.z {
                (DVec2::new(p.y, p.z), normal.x)
            } else if magnitude.y >= magnitude.z {
                (DVec2::new(p.z, p.x), normal.y)
            } else {
                (DVec2::new(p.x, p.y), normal.z)
            };
            if sign < 0.0 {
                DVec2::new(uv.y, uv.x)
            } else {
                uv
            }
        }));
    }

    fn is_ear(&self, ear: [u32; 3]) -> bool {
        let [a, b, c] = ear.map(|i| self.projected[i as usize]);
        if (b - a).perp_dot(c - b) <= 0.0 {
            return false;
        }
        self.remaining.iter().all(|&i| {
            let p = self.projected[i as usize];
            let at_corner = p == a || p == b || p == c;
            let inside = (b - a).perp_dot(p - a) >= 0.0
                && (c - b).perp_dot(p - b) >= 0.0
                && (a - c).perp_dot(p - c) >= 0.0;
            ear.contains(&i) || at_corner || !inside
        })
    }
}

/// Splits along the shorter diagonal of those that stay inside the quad.
fn split_quad(p: [Vec3; 4]) -> [[u32; 3]; 2] {
    const BY_02: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];
    const BY_13: [[u32; 3]; 2] = [[1, 2, 3], [1, 3, 0]];
    let agreement = |split: [[u32; 3]; 2]| {
        let [n, m] = split.map(|t| {
            let [a, b, c] = t.map(|i| p[i as usize]);
            (b - a).cross(c - a)
        });
        n.dot(m)
    };
    let is_convex_02 = agreement(BY_02) > 0.0;
    let is_convex_13 = agreement(BY_13) > 0.0;
    let is_shorter_13 = p[1].distance_squared(p[3]) < p[0].distance_squared(p[2]);
    if is_convex_02 == is_convex_13 && is_shorter_13 || is_convex_13 && !is_convex_02 {
        BY_13
    } else {
        BY_02
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every triangle has the polygon's orientation and their areas add up to its area.
    fn check(polygon: &[[f32; 2]]) {
        let area = |p: &[[f32; 2]]| -> f32 {
            (0..p.len())
                .map(|i| {
                    let (a, b) = (p[i], p[(i + 1) % p.len()]);
                    0.5 * (a[0] * b[1] - a[1] * b[0])
                })
                .sum()
        };
        // In a tilted plane, forward and backward.
        for reversed in [false, true] {
            let mut polygon = polygon.to_vec();
            if reversed {
                polygon.reverse();
            }
            let points: Vec<Vec3> = polygon
                .iter()
                .map(|p| Vec3::new(p[0] + 3.0, 2.0 * p[0] - p[1], p[1] - 0.5 * p[0]))
                .collect();
            let mut triangulator = Triangulator::default();
            let triangles = triangulator.triangulate(&points);
            assert_eq!(triangles.len(), polygon.len() - 2);
            let total = area(&polygon);
            let sum: f32 = triangles
                .iter()
                .map(|t| {
                    let a = area(&t.map(|i| polygon[i as usize]));
                    assert!(a * total >= 0.0, "{triangles:?}");
                    a
                })
                .sum();
            assert!((sum - total).abs() < 1e-5 * total.abs(), "{triangles:?}");
        }
    }

    #[test]
    fn convex_and_concave_polygons_are_covered_once() {
        check(&[[0., 0.], [1., 0.], [1., 1.], [0., 1.]]);
        // An arrow head: only one diagonal is inside.
        check(&[[0., 0.], [2., -1.], [0.5, 0.], [2., 1.]]);
        check(&[[0.5, 0.], [2., 1.], [0., 0.], [2., -1.]]);
        check(&[[0., 0.], [4., 0.], [4., 1.], [1., 1.], [1., 3.], [0., 3.]]);
        // A comb.
        check(&[
            [0., 0.],
            [5., 0.],
            [5., 3.],
            [4., 3.],
            [4., 1.],
            [3., 1.],
            [3., 3.],
            [2., 3.],
            [2., 1.],
            [1., 1.],
            [1., 3.],
            [0., 3.],
        ]);
        // A square with a hole, joined by a bridge that is walked twice.
        check(&[
            [0., 0.],
            [4., 0.],
            [4., 4.],
            [0., 4.],
            [0., 0.],
            [1., 1.],
            [1., 3.],
            [3., 3.],
            [3., 1.],
            [1., 1.],
        ]);
    }

    #[test]
    fn star_with_many_points() {
        let n = 100;
        let star: Vec<[f32; 2]> = (0..n)
            .map(|i| {
                let r = if i % 2 == 0 { 1.0 } else { 0.3 };
                let (sin, cos) = (std::f32::consts::TAU * i as f32 / n as f32).sin_cos();
                [r * cos, r * sin]
            })
            .collect();
        check(&star);
    }

    #[test]
    fn crossing_polygons_still_give_triangles() {
        let points = [[0., 0.], [1., 1.], [1., 0.], [0., 1.], [0.5, 2.]];
        let points = points.map(|p: [f32; 2]| Vec3::new(p[0], p[1], 0.0));
        assert_eq!(Triangulator::default().triangulate(&points).len(), 3);
        let same = [Vec3::ONE; 7];
        assert_eq!(Triangulator::default().triangulate(&same).len(), 5);
    }
}
