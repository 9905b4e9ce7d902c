//! What moves while the shutter is open, and what some rays do not meet.

use kilauea_math::{DAffine3, DMat4, DVec3};
use kilauea_mesh::CurveType;
use kilauea_scene::{Integrator, Light, LightShape, RenderSettings, Visibility};
use kilauea_tests::{
    Curves, Mesh, Picture, Placements, Points, Stage, black_emitter, check_near, light, matte,
    orthographic,
};

/// The right half of the window, as a mesh.
const RIGHT: [[f32; 3]; 4] = [
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [1.0, 0.0, -1.0],
    [0.0, 0.0, -1.0],
];

/// A window from -1 to 1 along x and z, seen from above, in which all that is there shines with 1.
fn window() -> Stage {
    let mut stage = Stage::new(orthographic([0.0, 3.0, 0.0], [0.0, 0.0, 0.0], 1.0));
    stage.materials = vec![black_emitter(1.0), matte([0.5; 3])];
    stage
}

/// The part of the window and of the time that is covered.
fn covered(stage: &Stage) -> f64 {
    let settings = RenderSettings {
        resolution: [32, 32],
        // What surfaces send each other is not asked for.
        max_depth: 1,
        ..Stage::settings()
    };
    let scene = stage.scene(settings.resolution);
    let options = kilauea_render::PrepareOptions::default();
    let prepared = kilauea_render::PreparedScene::new(scene, &options).expect("a sound scene");
    // Emissive meshes that move are said to be noisy: nothing here depends on it.
    Picture::render(&std::sync::Arc::new(prepared), settings).mean()
}

fn shift(x: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::X * x)
}

fn moving_column(shifts: &[f64]) -> Stage {
    let mut stage = window();
    stage.prototypes.push("/Prototype".into());
    stage.meshes = vec![Mesh::polygon(&RIGHT).in_prototype(1)];
    stage.instances = vec![Placements {
        parent: 0,
        prototype: 1,
        parent_from_prototype: vec![shift(shifts[0])],
        primvar: None,
        later: shifts[1..].iter().map(|&x| vec![shift(x)]).collect(),
    }];
    stage
}

#[test]
fn moving_instances() {
    check_near(covered(&moving_column(&[0.0])), 0.5, 0.01, "still");
    check_near(covered(&moving_column(&[0.0, 1.0])), 0.25, 0.01, "two keys");
    // Leaves to the right in the first half, and stays outside.
    check_near(
        covered(&moving_column(&[0.0, 1.0, 1.0])),
        0.125,
        0.01,
        "three keys",
    );
}

#[test]
fn motions_add_up() {
    let mut stage = moving_column(&[0.0, 0.5]);
    stage.prototypes.push("/Outer".into());
    stage.instances[0].parent = 2;
    stage.instances.push(Placements {
        parent: 0,
        prototype: 2,
        parent_from_prototype: vec![shift(0.0)],
        primvar: None,
        later: vec![vec![shift(0.25)], vec![shift(0.5)]],
    });
    check_near(covered(&stage), 0.25, 0.01, "nested");
}

#[test]
fn moving_meshes() {
    let mut stage = window();
    stage.meshes = vec![Mesh::polygon(&RIGHT).moving(&[[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])];
    check_near(covered(&stage), 0.125, 0.01, "deforming");
}

#[test]
fn moving_curves_and_points() {
    let mut stage = window();
    let along = |z: f32| [[-2.0, 0.0, z], [2.0, 0.0, z]];
    let mut curve = Curves::new(CurveType::Linear, &along(0.0), 0.5);
    curve.later_points = vec![along(2.25).to_vec()];
    stage.curves = vec![curve];
    // Half as wide as half of the window, all there until its middle reaches 0.75, gone at 1.25.
    check_near(covered(&stage), 0.25 * 1.0 / 2.25, 0.02, "curve");

    let mut stage = window();
    let mut point = Points::new(&[[-1.5, 0.0, 0.0]], 1.0);
    point.later_points = vec![vec![[1.5, 0.0, 0.0]]];
    stage.points = vec![point];
    let disc = std::f64::consts::PI * 0.25;
    check_near(covered(&stage), disc / 4.0 * 2.0 / 3.0, 0.02, "point");
}

#[test]
fn moving_cameras() {
    let mut stage = window();
    stage.meshes = vec![Mesh::polygon(&RIGHT)];
    let first = stage.camera.world_from_camera;
    let moved = DMat4::from_translation(DVec3::NEG_X) * first;
    stage.camera.later_world_from_camera = vec![moved];
    check_near(covered(&stage), 0.25, 0.01, "camera");
}

#[test]
fn all_rays_of_a_path_are_of_one_time() {
    // A roof flies past: at any time it shades as much of the floor as it hides from above.
    let mut stage = window();
    stage.meshes = vec![
        Mesh::floor(4.0).with_material(1),
        Mesh::polygon(&RIGHT)
            .with_material(1)
            .placed(DAffine3::from_translation(DVec3::Y))
            .moving(&[[-1.0, 0.0, 0.0]]),
    ];
    stage.lights = vec![overhead()];
    let seen = covered(&stage);
    // The roof's own upper side is as bright as the floor that it shades: nothing dark is seen.
    let mut still = stage.clone();
    still.meshes.truncate(1);
    check_near(seen, covered(&still), 0.01, "shadow under the roof");
}

/// A sun straight above.
fn overhead() -> Light {
    let down = DMat4::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    light(LightShape::Distant { angle_degrees: 0.0 }, down)
}

#[test]
fn roofs_that_only_some_rays_meet() {
    let with_roof = |visibility| {
        let mut stage = window();
        let roof = Mesh::floor(4.0)
            .with_material(0)
            .placed(DAffine3::from_translation(DVec3::Y));
        stage.meshes = vec![Mesh::floor(4.0).with_material(1), roof.met_by(visibility)];
        stage.lights = vec![overhead()];
        stage
    };
    let lit = {
        let mut stage = with_roof(Visibility::ALL);
        stage.meshes.truncate(1);
        stage.render(|_| ()).mean()
    };
    // The roof shines with 1, the floor reflects half of what reaches it.
    check_near(
        with_roof(Visibility::CAMERA).render(|_| ()).mean(),
        1.0,
        1e-5,
        "seen",
    );
    let shadow = with_roof(Visibility::SHADOW).render(|_| ()).mean();
    assert_eq!(shadow, 0.0);
    let indirect = with_roof(Visibility::INDIRECT)
        .render(|s| s.max_depth = 1)
        .mean();
    // Most of the half sphere above the middle of the floor is roof.
    assert!(indirect > lit + 0.35, "{indirect} {lit}");
}

#[test]
fn threads_and_general_code_do_not_change_a_bit_of_a_blurred_frame() {
    let mut stage = window();
    stage.prototypes.push("/Prototype".into());
    stage.meshes = vec![
        Mesh::floor(2.0).with_material(1),
        Mesh::cube()
            .in_prototype(1)
            .with_material(1)
            .placed(DAffine3::from_scale(DVec3::splat(0.2))),
    ];
    stage.instances = vec![Placements {
        parent: 0,
        prototype: 1,
        parent_from_prototype: vec![shift(-0.5), shift(0.5)],
        primvar: None,
        later: vec![vec![shift(-0.2), shift(0.6)]],
    }];
    let mut dust = Points::new(&[[0.0, 0.5, 0.5]], 0.3);
    dust.material = 1;
    dust.later_points = vec![vec![[0.2, 0.5, 0.5]]];
    stage.points = vec![dust];
    let mut hair = Curves::new(
        CurveType::Cubic,
        &[[-0.8, 0.3, -0.5], [0.0, 0.6, -0.8], [0.8, 0.3, -0.5]],
        0.1,
    );
    hair.material = 1;
    stage.curves = vec![hair];
    stage.lights = vec![overhead()];
    let render = |threads, specialize| {
        stage.render(|s| {
            s.resolution = [40, 36];
            s.samples_per_pixel = 4;
            (s.threads, s.specialize) = (threads, specialize);
            s.integrator = Integrator::Path;
        })
    };
    let reference = render(1, true);
    assert!(reference.stats.needs.contains(&"motion".into()));
    render(3, true).check_same_bits(&reference, "three threads");
    render(1, false).check_same_bits(&reference, "the general code");
}
