//! Media that absorb, against the law of Beer and Lambert.

use kilauea_math::{DAffine3, DMat4, DVec3};
use kilauea_scene::{Camera, LightShape, Material};
use kilauea_tests::{
    Mesh, Picture, Stage, black_emitter, check_near, glass, light, orthographic, perspective,
};

const COLOR: [f32; 3] = [0.9, 0.5, 0.1];

/// Absorbs to [`COLOR`] within a distance of one half.
fn amber(ior: f32) -> Material {
    glass(&[
        ("ior", &[ior]),
        ("transmissionColor", &COLOR),
        ("transmissionDepth", &[0.5]),
    ])
}

/// A box of the first material between two heights.
fn slab(bottom: f64, top: f64) -> Mesh {
    let half = DVec3::new(2.0, (top - bottom) / 2.0, 2.0);
    let center = DVec3::new(0.0, f64::midpoint(top, bottom), 0.0);
    Mesh::cube().placed(DAffine3::from_translation(center) * DAffine3::from_scale(half))
}

fn in_dome(camera: Camera, meshes: Vec<Mesh>, materials: Vec<Material>) -> Picture {
    let mut stage = Stage::new(camera);
    stage.meshes = meshes;
    stage.materials = materials;
    stage.lights.push(light(LightShape::Dome, DMat4::IDENTITY));
    stage.render(|s| {
        s.samples_per_pixel = 256;
        s.max_depth = 64;
    })
}

fn looking_down() -> Camera {
    orthographic([0.0, 2.0, 0.0], [0.0; 3], 0.1)
}

/// Holds each channel against a function of the fraction that passes a unit of distance.
fn check_channels(picture: &Picture, expected: impl Fn(f64) -> f64, what: &str) {
    for (name, color) in ["R", "G", "B"].into_iter().zip(COLOR) {
        let per_unit = f64::from(color).powi(2);
        let what = format!("{what}, {name}");
        check_near(picture.mean_of(name), expected(per_unit), 0.01, &what);
    }
}

/// Radiance of a slab across which the fraction `a` passes, with a white dome on both sides: what
/// it reflects, and all that leaves it after any number of reflections inside.
fn of_slab(ior: f64, a: f64) -> f64 {
    let r = ((ior - 1.0) / (ior + 1.0)).powi(2);
    r + (1.0 - r).powi(2) * a / (1.0 - r * a)
}

#[test]
fn a_slab_absorbs_by_its_thickness() {
    for ior in [1.0, 1.5, 2.4_f32] {
        for thickness in [0.05, 0.6] {
            let picture = in_dome(looking_down(), vec![slab(0.0, thickness)], vec![amber(ior)]);
            let expected = |per_unit: f64| of_slab(ior.into(), per_unit.powf(thickness));
            check_channels(&picture, expected, &format!("ior {ior}, {thickness}"));
        }
    }
}

#[test]
fn slabs_of_one_material_that_overlap_are_one_slab() {
    let slabs = vec![slab(0.0, 0.3), slab(0.2, 0.5)];
    let picture = in_dome(looking_down(), slabs, vec![amber(1.5)]);
    check_channels(
        &picture,
        |per_unit| of_slab(1.5, per_unit.powf(0.5)),
        "both",
    );
}

#[test]
fn what_shines_within_a_medium_is_absorbed_on_the_way() {
    let sheet = Mesh::floor(3.0)
        .with_material(1)
        .placed(DAffine3::from_translation(DVec3::new(0.0, 0.1, 0.0)));
    let mut lamp = light(
        LightShape::Rect {
            width: 1.0,
            height: 1.0,
        },
        kilauea_tests::facing_down(0.0, 0.1, 0.0) * DMat4::from_rotation_x(std::f64::consts::PI),
    );
    lamp.radiance *= 2.0;
    for (name, meshes, lights) in [
        ("mesh", vec![slab(0.0, 0.4), sheet], vec![]),
        ("lamp", vec![slab(0.0, 0.4)], vec![lamp]),
    ] {
        let mut stage = Stage::new(looking_down());
        stage.meshes = meshes;
        stage.materials = vec![amber(1.0), black_emitter(2.0)];
        stage.lights = lights;
        let picture = stage.render(|s| s.samples_per_pixel = 4);
        check_channels(&picture, |per_unit| 2.0 * per_unit.powf(0.3), name);
    }
}

#[test]
fn a_camera_within_a_medium_knows_it() {
    let camera = || perspective([0.0, 0.2, 0.0], [0.0, -5.0, 0.0], 0.01);
    let picture = in_dome(camera(), vec![slab(-0.1, 0.6)], vec![amber(1.0)]);
    check_channels(&picture, |per_unit| per_unit.powf(0.3), "inside");
    // Sheets with edges above and below hold nothing.
    let sheet = |y: f64| {
        let place = DAffine3::from_translation(DVec3::new(0.0, y, 0.0));
        Mesh::floor(0.3).placed(place)
    };
    let sheets = vec![sheet(0.3), sheet(1.0).inside_out()];
    let picture = in_dome(camera(), sheets, vec![amber(1.0)]);
    check_near(picture.mean(), 1.0, 1e-4, "outside");
}
