//! Triangles that shine from so close by that distances to their parts differ.

use kilauea_math::{DVec3, Vec2, Vec3, warp};
use kilauea_testing::{Directions, Family, Moments, project, uniforms};

use super::lit::{Lit, Sees, compare_density, prepare, share_not_found};
use crate::PreparedScene;
use crate::light::{ByImportance, ChosenLight, Emitted, Receiver};

/// A triangle that shines with radiance one, as a point sees it.
struct Case {
    name: &'static str,
    triangle: [Vec3; 3],
    receiver: Receiver,
    /// Half of the angle around its center that the triangle about fills, in radians.
    half_angle: f64,
}

const LAMP: [Vec3; 3] = [
    Vec3::new(-0.6, -0.3, 0.0),
    Vec3::new(0.5, -0.4, 0.0),
    Vec3::new(0.1, 0.6, 0.0),
];

fn cases() -> Vec<Case> {
    let facing = |p: Vec3, n: Vec3| Receiver {
        p,
        n: n.normalize(),
    };
    let wedge = [
        Vec3::new(0.0, -0.9, 0.0),
        Vec3::new(0.3, 0.8, 0.0),
        Vec3::new(-0.1, 0.7, 0.1),
    ];
    vec![
        Case {
            name: "above a lamp",
            triangle: LAMP,
            receiver: facing(Vec3::new(0.1, -0.1, 0.1), Vec3::NEG_Z),
            half_angle: 1.3,
        },
        Case {
            name: "above the rim of a lamp",
            triangle: LAMP,
            receiver: facing(Vec3::new(0.45, -0.35, -0.04), Vec3::new(-0.4, 0.3, 1.0)),
            half_angle: 1.0,
        },
        Case {
            name: "beside a lamp",
            triangle: LAMP,
            receiver: facing(Vec3::new(-0.7, 0.2, 0.3), Vec3::new(0.9, -0.3, -0.2)),
            half_angle: 0.5,
        },
        Case {
            name: "along a strip",
            triangle: wedge,
            receiver: facing(Vec3::new(0.05, -0.8, 0.15), Vec3::new(0.0, 0.6, -1.0)),
            half_angle: 0.8,
        },
        Case {
            name: "far from a lamp",
            triangle: LAMP,
            receiver: facing(Vec3::new(1.0, 2.0, 6.0), Vec3::NEG_Z),
            half_angle: 0.1,
        },
    ]
}

fn for_each_case(mut check: impl FnMut(&Case, &Lit<'_>, &Directions)) {
    for case in cases() {
        let prepared = prepare(Vec::new(), &[case.triangle], Vec::new());
        let seen = lit(&prepared, case.receiver);
        // Off the center, so that no edge runs along cells.
        let to_center = case.triangle.iter().sum::<Vec3>() / 3.0 - case.receiver.p;
        let aside = 0.05 * to_center.length() * to_center.any_orthonormal_vector();
        check(
            &case,
            &seen,
            &Directions::around(to_center + aside, case.half_angle),
        );
    }
}

fn lit(prepared: &PreparedScene, receiver: Receiver) -> Lit<'_> {
    Lit {
        prepared,
        receiver,
        chooser: ByImportance,
    }
}

#[test]
fn directions_are_drawn_with_the_density_that_rays_find() {
    let mut family = Family::new("densities of near triangles");
    for_each_case(|case, seen, directions| {
        let found = compare_density(seen, directions, family.len() as u32);
        family.add(format!("{}: {found:?}", case.name), found.p_value());
        let share = share_not_found(seen, 0);
        assert!(share < 2e-3, "{}: {share}", case.name);
    });
    family.check();
}

/// Rays that find a triangle with the density per solid angle of a point drawn evenly on it.
struct FoundByArea<'a> {
    sound: &'a Lit<'a>,
    triangle: [Vec3; 3],
}

impl Sees for FoundByArea<'_> {
    fn sample(&self, u: [f32; 3]) -> Option<ChosenLight> {
        self.sound.sample(u)
    }

    fn for_each_arriving(&self, dir: Vec3, mut visit: impl FnMut(&Emitted)) {
        let [a, b, c] = self.triangle;
        let area_vector = 0.5 * (b - a).cross(c - a);
        let distance = (a - self.sound.receiver.p).dot(area_vector) / dir.dot(area_vector);
        let pdf = distance * distance / area_vector.dot(dir).abs();
        self.sound
            .for_each_arriving(dir, |e| visit(&Emitted { pdf, ..*e }));
    }

    fn n(&self) -> Vec3 {
        self.sound.n()
    }
}

#[test]
fn another_density_than_that_of_draws_is_noticed() {
    for_each_case(|case, sound, directions| {
        let seen = FoundByArea {
            sound,
            triangle: case.triangle,
        };
        let p = compare_density(&seen, directions, 0).p_value();
        let is_far = case.name.starts_with("far");
        assert_eq!(p > 1e-3, is_far, "{}: {p}", case.name);
        assert_eq!(share_not_found(&seen, 0) < 2e-3, is_far, "{}", case.name);
    });
}

/// Irradiance by a polygon of radiance one above the horizon (Lambert 1760): half the sum over its
/// edges of their angle times the cosine between the normals of receiver and edge.
fn lambert_irradiance(triangle: [Vec3; 3], receiver: Receiver) -> f64 {
    let toward = triangle.map(|q| (q.as_dvec3() - receiver.p.as_dvec3()).normalize());
    let n = receiver.n.as_dvec3();
    assert!(toward.iter().all(|v| v.dot(n) >= 0.0));
    let of_edge = |i: usize| {
        let (v, w) = (toward[i], toward[(i + 1) % 3]);
        v.angle_between(w) * v.cross(w).normalize_or(DVec3::ZERO).dot(n)
    };
    0.5 * (0..3).map(of_edge).sum::<f64>().abs()
}

/// What a draw of a point that is even on the triangle brings.
fn irradiance_by_area(triangle: [Vec3; 3], receiver: Receiver, u: [f32; 2]) -> f64 {
    let [a, b, c] = triangle;
    let weights = warp::uniform_triangle(Vec2::from_array(u));
    let to_point = a + weights.x * (b - a) + weights.y * (c - a) - receiver.p;
    let area_vector = 0.5 * (b - a).cross(c - a);
    let cosines = receiver.n.dot(to_point) * area_vector.dot(to_point).abs();
    f64::from(cosines / to_point.length_squared().powi(2))
}

#[test]
fn a_near_triangle_brings_what_lambert_says_with_little_noise() {
    const N_DRAWS: u32 = 20_000;
    let mut family = Family::new("irradiance of near triangles");
    for_each_case(|case, seen, _| {
        let Case {
            name,
            triangle,
            receiver,
            ..
        } = *case;
        let of_draw = |i| {
            let light = seen.sample(uniforms(31, i)).map(|light| light.sample);
            light.map_or(0.0, |l| {
                project(l.radiance) * f64::from(l.wi.dot(receiver.n).max(0.0) / l.pdf)
            })
        };
        let by_lights = Moments::of(&(0..N_DRAWS).map(of_draw).collect::<Vec<_>>());
        let expected = lambert_irradiance(triangle, receiver);
        family.add(name, by_lights.p_value(expected, 1e-5 * expected));

        let by_area = |i| irradiance_by_area(triangle, receiver, uniforms(32, i));
        let by_area = Moments::of(&(0..N_DRAWS).map(by_area).collect::<Vec<_>>());
        let ratio = by_lights.variance / by_area.variance;
        if !name.starts_with("far") {
            assert!(ratio < 0.1, "{name}: {ratio}");
        }
    });
    family.check();
}
