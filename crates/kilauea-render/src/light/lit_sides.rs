//! From which side emissive triangles can be seen.
//!
//! An opaque surface that is closed hides one of its sides from a camera on the other, and what emits
//! there lights nothing that the camera sees. To look for light there is to find it hidden.

use std::collections::HashMap;
use std::f64::consts::PI;

use kilauea_math::{DVec3, Vec3};

/// The sides of a triangle on which light is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LitSides {
    Both,
    /// That to which (b − a) × (c − a) points.
    Front,
    Back,
}

impl LitSides {
    /// Of each of an opaque mesh's triangles, as far as paths from a camera see them.
    ///
    /// Parts of a mesh are what edges connect. A part is closed where each edge has two triangles,
    /// which run along it in opposite directions: as around the handles of a solid.
    pub(super) fn of_mesh(triangles: &[[Vec3; 3]], camera: Vec3) -> Vec<Self> {
        let (mut parts, mut is_open) = (Parts::new(triangles.len()), vec![false; triangles.len()]);
        let edges = edges(triangles);
        for of_edge in edges.chunk_by(|a, b| a.ends == b.ends) {
            let is_closed = matches!(of_edge, [a, b] if a.is_reversed != b.is_reversed);
            for edge in of_edge {
                parts.join(of_edge[0].triangle, edge.triangle);
                is_open[edge.triangle] |= !is_closed;
            }
        }
        let of_triangles: Vec<usize> = (0..triangles.len()).map(|i| parts.of(i)).collect();
        let mut of_parts = vec![Part::default(); triangles.len()];
        for (triangle, &part) in of_triangles.iter().enumerate() {
            of_parts[part].add(&triangles[triangle], triangles[part][0], camera);
            of_parts[part].is_open |= is_open[triangle];
        }
        of_triangles
            .iter()
            .map(|&part| of_parts[part].lit_sides())
            .collect()
    }

    /// Whether the light of a triangle is looked for from `p`.
    #[inline]
    pub(super) fn face(self, corners: &[Vec3; 3], p: Vec3) -> bool {
        let [a, b, c] = *corners;
        let height = || (b - a).cross(c - a).dot(p - a);
        match self {
            Self::Both => true,
            Self::Front => height() > 0.0,
            Self::Back => height() < 0.0,
        }
    }
}

/// An edge of a triangle.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    /// Points at its ends, the lower number first.
    ends: [u32; 2],
    is_reversed: bool,
    triangle: usize,
}

/// All edges, those with the same ends beside each other.
fn edges(triangles: &[[Vec3; 3]]) -> Vec<Edge> {
    let mut points = HashMap::new();
    let mut edges = Vec::with_capacity(3 * triangles.len());
    for (triangle, corners) in triangles.iter().enumerate() {
        let corners = corners.map(|p| {
            let next = points.len() as u32;
            // + 0 makes one of both zeros.
            let bits = (p + 0.0).to_array().map(f32::to_bits);
            *points.entry(bits).or_insert(next)
        });
        edges.extend((0..3).map(|i| {
            let (from, to) = (corners[i], corners[(i + 1) % 3]);
            Edge {
                ends: [from.min(to), from.max(to)],
                is_reversed: from > to,
                triangle,
            }
        }));
    }
    edges.sort_unstable();
    edges
}

/// `volume`² over `area`³ up to which a part is folded flat, and rounding says where its inside is; 0.04
/// for a sphere.
const FLAT: f64 = 1e-9;

/// What triangles of a part add up to.
#[derive(Clone, Copy, Default)]
struct Part {
    is_open: bool,
    /// Six times the volume, negative where fronts are inside.
    volume: f64,
    /// Twice the area.
    area: f64,
    /// Solid angle of all fronts less that of all backs, from the camera.
    solid_angle: f64,
}

impl Part {
    fn add(&mut self, corners: &[Vec3; 3], apex: Vec3, camera: Vec3) {
        let seen_from = |p: Vec3| corners.map(|corner| corner.as_dvec3() - p.as_dvec3());
        let [a, b, c] = seen_from(apex);
        self.volume += a.dot(b.cross(c));
        self.area += (b - a).cross(c - a).length();
        // Van Oosterom & Strackee 1983.
        let [a, b, c] = seen_from(camera).map(DVec3::normalize_or_zero);
        let cosines = a.dot(b) + b.dot(c) + c.dot(a);
        self.solid_angle -= 2.0 * a.dot(b.cross(c)).atan2(1.0 + cosines);
    }

    fn lit_sides(&self) -> LitSides {
        // All of the sphere where the camera is inside, nothing where it is outside.
        let is_camera_inside = self.solid_angle.abs() > 2.0 * PI;
        let has_inside = !self.is_open && self.volume.powi(2) > FLAT * self.area.powi(3);
        if !has_inside {
            LitSides::Both
        } else if (self.volume > 0.0) == is_camera_inside {
            LitSides::Back
        } else {
            LitSides::Front
        }
    }
}

/// Disjoint sets, each named by its least member.
struct Parts(Vec<usize>);

impl Parts {
    fn new(n: usize) -> Self {
        Self((0..n).collect())
    }

    fn of(&mut self, mut member: usize) -> usize {
        while self.0[member] != member {
            self.0[member] = self.0[self.0[member]];
            member = self.0[member];
        }
        member
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.of(a), self.of(b));
        self.0[a.max(b)] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OUTSIDE: Vec3 = Vec3::new(5.0, 4.0, 3.0);

    /// A cube of that size around a point, with fronts outside.
    fn cube(center: Vec3, size: f32) -> Vec<[Vec3; 3]> {
        let side = |z: Vec3, x: Vec3| {
            let y = z.cross(x);
            let corner = |u: f32, v: f32| center + 0.5 * size * (z + u * x + v * y);
            let [a, b, c, d] = [
                corner(-1.0, -1.0),
                corner(1.0, -1.0),
                corner(1.0, 1.0),
                corner(-1.0, 1.0),
            ];
            [[a, b, c], [a, c, d]]
        };
        let axes = [Vec3::X, Vec3::Y, Vec3::Z];
        let sides = |i: usize| [1.0, -1.0].map(|sign| side(sign * axes[i], axes[(i + 1) % 3]));
        (0..3).flat_map(sides).flatten().collect()
    }

    fn turned_over(triangles: &[[Vec3; 3]]) -> Vec<[Vec3; 3]> {
        triangles.iter().map(|&[a, b, c]| [a, c, b]).collect()
    }

    fn check(triangles: &[[Vec3; 3]], camera: Vec3, expected: LitSides) {
        let found = LitSides::of_mesh(triangles, camera);
        assert_eq!(found, vec![expected; triangles.len()]);
    }

    #[test]
    fn of_a_solid_the_side_is_lit_on_which_the_camera_is() {
        // Corners that are zero have either sign.
        for center in [Vec3::ZERO, Vec3::splat(0.5), Vec3::new(0.1, -0.7, 1.3)] {
            let cube = cube(center, 1.0);
            check(&cube, OUTSIDE, LitSides::Front);
            check(&cube, center + 0.3, LitSides::Back);
            check(&turned_over(&cube), OUTSIDE, LitSides::Back);
            check(&turned_over(&cube), center + 0.3, LitSides::Front);
        }
    }

    #[test]
    fn of_what_is_open_or_flat_both_sides_are_lit() {
        let cube = cube(Vec3::ZERO, 1.0);
        check(&cube[1..], OUTSIDE, LitSides::Both);
        let mut one_over = cube.clone();
        one_over[5] = turned_over(&cube)[5];
        check(&one_over, OUTSIDE, LitSides::Both);
        check(
            &[cube.clone(), cube.clone()].concat(),
            OUTSIDE,
            LitSides::Both,
        );
        let flat: Vec<_> = cube
            .iter()
            .map(|corners| corners.map(|p| Vec3::new(p.x, p.y, 0.3 * p.x)))
            .collect();
        check(&flat, OUTSIDE, LitSides::Both);
        check(&[[Vec3::NAN; 3]; 4], OUTSIDE, LitSides::Both);
        check(&[], OUTSIDE, LitSides::Both);
    }

    #[test]
    fn parts_of_a_mesh_are_told_apart() {
        let around_camera = turned_over(&cube(OUTSIDE, 2.0));
        let mesh = [
            cube(Vec3::ZERO, 1.0),
            around_camera,
            turned_over(&cube(Vec3::ONE, 0.5)),
            cube(Vec3::NEG_ONE, 0.5)[1..].to_vec(),
        ];
        let expected = [
            vec![LitSides::Front; 12],
            vec![LitSides::Front; 12],
            vec![LitSides::Back; 12],
            vec![LitSides::Both; 11],
        ];
        assert_eq!(
            LitSides::of_mesh(&mesh.concat(), OUTSIDE),
            expected.concat()
        );
    }

    #[test]
    fn a_side_faces_what_is_before_it() {
        let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
        for (sides, above, below) in [
            (LitSides::Both, true, true),
            (LitSides::Front, true, false),
            (LitSides::Back, false, true),
        ] {
            assert_eq!(sides.face(&triangle, Vec3::new(3.0, 2.0, 0.1)), above);
            assert_eq!(sides.face(&triangle, Vec3::new(3.0, 2.0, -0.1)), below);
        }
    }
}
