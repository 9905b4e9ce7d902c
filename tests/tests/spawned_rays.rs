//! Rays that leave a surface do not meet the triangle they left, and miss nothing close to it.

use kilauea_accel::{Hit, Ray, Visibility};
use kilauea_math::hash::{combine, unit_f32};
use kilauea_math::{DAffine3, DVec3, Vec2, Vec3};
use kilauea_render::{PreparedScene, View};
use kilauea_tests::{Mesh, Placements, Stage, matte, perspective};
use std::sync::Arc;

/// Least sine between ray and surface; below it the rounding of the direction decides on the side.
const LEAST_SINE: f32 = 2e-6;

fn prepare(mut stage: Stage) -> Arc<PreparedScene> {
    stage.materials = vec![matte([0.5; 3])];
    stage.prepare(&Stage::settings())
}

fn empty() -> Stage {
    Stage::new(perspective([0.0, 0.0, 5.0], [0.0; 3], 0.5))
}

/// A cube under each of the matrices, as instances of one prototype.
fn instances(places: &[DAffine3]) -> Stage {
    let mut stage = empty();
    stage.prototypes.push("/Prototype".into());
    stage.meshes.push(Mesh::cube().in_prototype(1));
    stage.instances.push(Placements {
        parent: 0,
        prototype: 1,
        parent_from_prototype: places.to_vec(),
        primvar: None,
        later: Vec::new(),
    });
    stage
}

fn turn(angle: f64) -> DAffine3 {
    DAffine3::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), angle)
}

fn scale(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_scale(DVec3::new(x, y, z))
}

fn at(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z))
}

/// A point on a random triangle.
fn random_hit(scene: &PreparedScene, seed: u32) -> Hit {
    let number = |dimension| unit_f32(combine(seed, dimension));
    let instance = (number(0) * scene.geometry.n_placements() as f32) as u32;
    let chunks = scene.geometry.meshes(instance);
    let n_triangles: usize = chunks.iter().map(|chunk| chunk.triangles.len()).sum();
    let (u, v) = (number(1), number(2));
    let (u, v) = if u + v < 1.0 {
        (u, v)
    } else {
        (1.0 - u, 1.0 - v)
    };
    Hit {
        t: 0.0,
        u,
        v,
        primitive: (number(3) * n_triangles as f32) as u32,
        instance,
    }
}

/// The hit of a triangle as it is seen along `wo`.
fn view(hit: &Hit, wo: Vec3) -> View {
    View {
        uv: Vec2::new(hit.u, hit.v),
        p_ray: Vec3::ZERO,
        wo,
        time: 0.0,
        footprint: 0.0,
    }
}

/// Leaves random points to either side, often grazing.
fn check_no_self_hits(name: &str, stage: Stage) {
    let scene = prepare(stage);
    let geometry = &scene.geometry;
    for seed in 0..20_000 {
        let number = |dimension| unit_f32(combine(seed, dimension));
        let left = random_hit(&scene, seed);
        let at = geometry.locate(&left);
        let interaction = geometry.interaction(at, &view(&left, Vec3::Y), &scene.textures);
        let n = interaction.surface.ng * if number(4) < 0.5 { 1.0 } else { -1.0 };
        let angle = std::f32::consts::TAU * number(5);
        let tangent = n.any_orthonormal_vector().rotate_axis(n, angle);
        let sine = LEAST_SINE.powf(number(6));
        let dir = (n * sine + tangent * (1.0 - sine * sine).sqrt()).normalize();
        let ray = interaction.spawn_ray(dir, f32::INFINITY, Visibility::INDIRECT);
        if let Some(hit) = geometry.accel().intersect(&ray) {
            assert_ne!(geometry.locate(&hit), at, "{name}: {ray:?} {hit:?}");
        }
    }
}

#[test]
fn no_ray_meets_the_triangle_it_left() {
    let cases = [
        (
            "plain",
            vec![at(0.0, 0.0, 0.0), at(4.0, 1.0, 0.0) * turn(0.7)],
        ),
        (
            "mirrored",
            vec![
                scale(-1.0, 1.0, 1.0),
                at(3.0, 3.0, 0.0) * turn(1.2) * scale(1.0, -2.0, 0.5),
            ],
        ),
        (
            "stretched",
            vec![
                scale(1e4, 1.0, 1e4),
                turn(0.3) * scale(1.0, 1e-4, 1e4) * turn(1.9),
            ],
        ),
        (
            "tiny",
            vec![
                scale(1e-4, 1e-4, 1e-4),
                at(1e-3, 0.0, 0.0) * scale(1e-4, -1e-4, 1e-4),
            ],
        ),
        (
            "far",
            vec![at(1e6, 0.0, 0.0), at(1e6, 3.0, -2.0) * turn(0.4)],
        ),
        (
            "far apart",
            vec![
                at(1e6, 0.0, 0.0) * scale(1e4, 1e4, 1e4),
                at(-1e6, 1e5, 0.0) * turn(2.0) * scale(1e5, 1e4, 1e5),
            ],
        ),
    ];
    for (name, places) in cases {
        check_no_self_hits(name, instances(&places));
    }
}

#[test]
fn nor_where_triangles_are_thin_or_huge() {
    let mut thin = empty();
    for width in [1e-2, 1e-4, 1e-6_f32] {
        let triangle = [
            [-1.0, 0.1, 0.2],
            [1.0, 0.3, 0.5],
            [-1.0 + width, 0.1 + width, 0.2],
        ];
        thin.meshes.push(Mesh::polygon(&triangle));
    }
    let bar = turn(1.0) * scale(1.0, 1e-3, 1e-3);
    thin.meshes.push(Mesh::cube().placed(bar));
    check_no_self_hits("thin", thin);

    let mut huge = empty();
    huge.meshes.push(Mesh::floor(1e7).placed(turn(0.5)));
    check_no_self_hits("huge", huge);
}

/// Two sheets close to each other: what leaves the lower one upward must meet the upper one.
fn check_shell(half_width: f32, gap: f64) {
    let mut stage = empty();
    let tilt = turn(0.9);
    stage.meshes.push(Mesh::floor(half_width).placed(tilt));
    let lifted = tilt * at(0.0, gap, 0.0);
    stage.meshes.push(Mesh::floor(half_width).placed(lifted));
    let scene = prepare(stage);
    let geometry = &scene.geometry;
    let up = tilt.transform_vector3(DVec3::Y).as_vec3();
    for seed in 0..5000 {
        let number = |dimension| 2.0 * unit_f32(combine(seed, dimension)) - 1.0;
        let below = DVec3::new(number(0).into(), -0.1, number(1).into()) * f64::from(half_width);
        let origin = tilt.transform_point3(0.9 * below) - scene.scene.origin_world;
        let probe = Ray::new(origin.as_vec3(), up);
        let hit = geometry.accel().intersect(&probe).expect("the lower sheet");
        let at = geometry.locate(&hit);
        let interaction = geometry.interaction(at, &view(&hit, -up), &scene.textures);
        let aside = Vec3::new(number(2), number(3), number(4));
        let ray = interaction.spawn_ray(
            (up + 0.5 * aside).normalize(),
            f32::INFINITY,
            Visibility::INDIRECT,
        );
        let next = geometry.accel().intersect(&ray);
        let next = next.unwrap_or_else(|| panic!("{half_width}: {ray:?} skips the shell"));
        assert_ne!(geometry.locate(&next), at, "a self-hit");
        assert!(f64::from(next.t) < 4.0 * gap, "{half_width}: {next:?}");
    }
}

#[test]
fn a_shell_close_above_is_not_skipped() {
    check_shell(1.0, 4e-5);
    check_shell(100.0, 4e-5);
    check_shell(1e4, 4e-3);
}
