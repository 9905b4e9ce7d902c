//! Dielectrics that overlap: what is there is decided by their priorities.

use kilauea_math::{DAffine3, DMat4, DVec3};
use kilauea_scene::{LightShape, Material, RenderSettings};
use kilauea_tests::{
    Mesh, Picture, Stage, check_near, glass, light, matte, perspective, preview, rect_light,
    rel_mse,
};

fn dielectric(ior: f32, priority: f32) -> Material {
    glass(&[("ior", &[ior]), ("priority", &[priority])])
}

/// A cube from `−half` to `half`.
fn cube(half: f64, material: u32) -> Mesh {
    let place = DAffine3::from_scale(DVec3::splat(half));
    Mesh::cube().placed(place).with_material(material)
}

fn dome() -> kilauea_scene::Light {
    light(LightShape::Dome, DMat4::IDENTITY)
}

/// Looks at what is around the origin, slightly from above.
fn stage(materials: Vec<Material>, meshes: Vec<Mesh>) -> Stage {
    let mut stage = Stage::new(perspective([0.4, 1.1, 4.0], [0.0; 3], 0.35));
    stage.materials = materials;
    stage.meshes = meshes;
    stage
}

fn settings() -> RenderSettings {
    RenderSettings {
        resolution: [32, 32],
        max_depth: 32,
        ..Stage::settings()
    }
}

fn render(stage: &Stage) -> Picture {
    stage.render(|s| *s = settings())
}

/// A die in liquid in a box of glass, on a floor. The liquid reaches to `liquid`, the inner side
/// of the glass is at 0.7.
fn die_in_liquid_in_glass(boundaries: Vec<Mesh>, media: [Material; 2]) -> Stage {
    let [glass, liquid] = media;
    let mut stage = stage(
        vec![glass, liquid, matte([0.8, 0.3, 0.2]), matte([0.6; 3])],
        boundaries,
    );
    stage.meshes.push(cube(0.3, 2));
    let floor = DAffine3::from_translation(DVec3::new(0.0, -1.01, 0.0));
    stage
        .meshes
        .push(Mesh::floor(3.0).with_material(3).placed(floor));
    stage.lights = vec![rect_light(3.0, 3.0, 3.0), dome()];
    stage
}

#[test]
fn liquid_that_reaches_into_the_glass_is_as_one_that_ends_at_it() {
    // One boundary between liquid and glass, whose index is that of the inside over the outside.
    let clear = |ior: f32| preview(&[("opacity", &[0.0]), ("roughness", &[0.0]), ("ior", &[ior])]);
    let exact = render(&die_in_liquid_in_glass(
        vec![cube(1.0, 0), cube(0.7, 1)],
        [clear(1.5), clear(1.33 / 1.5)],
    ));
    for reach in [0.7 + 1e-6, 0.75, 0.95] {
        let overlapping = render(&die_in_liquid_in_glass(
            vec![cube(1.0, 0), cube(0.7, 0).inside_out(), cube(reach, 1)],
            [dielectric(1.5, 2.0), dielectric(1.33, 1.0)],
        ));
        // Hidden boundaries take no random numbers, so even the noise is the same but for paths
        // that rounding sends elsewhere.
        check_near(overlapping.mean(), exact.mean(), 2e-3, &format!("{reach}"));
        let error = rel_mse(&overlapping, &exact);
        assert!(error < 2e-3, "{reach}: {error}");
    }
    // The liquid in place of the glass is something else.
    let wrong = render(&die_in_liquid_in_glass(
        vec![cube(1.0, 0), cube(0.7, 0).inside_out(), cube(0.95, 1)],
        [dielectric(1.5, 1.0), dielectric(1.33, 2.0)],
    ));
    let error = rel_mse(&wrong, &exact);
    assert!(error > 0.006, "{error}");
}

#[test]
fn media_that_absorb_nothing_are_invisible_in_a_dome() {
    // Both reach of each other, apart and overlapping; of different and of equal index.
    for gap in [1e-6, -1e-6, 0.0, 0.1, -0.1] {
        for ior in [1.33, 1.5] {
            let mut stage = stage(
                vec![
                    dielectric(1.5, 2.0),
                    dielectric(ior, 1.0),
                    dielectric(1.31, 1.0),
                ],
                vec![
                    cube(1.0, 0),
                    cube(0.7, 0).inside_out(),
                    cube(0.7 - gap, 1),
                    cube(0.3, 2),
                ],
            );
            stage.lights.push(dome());
            let picture = stage.render(|s| {
                s.max_depth = 100;
            });
            check_near(picture.mean(), 1.0, 2e-3, &format!("gap {gap} ior {ior}"));
        }
    }
}

/// A floor and a lamp in one medium, with or without a lower one in between.
fn under_water(with_bubble: bool, light: kilauea_scene::Light) -> Picture {
    let water = [0.7, 0.8, 0.9];
    let mut stage = Stage::new(perspective([0.0, 0.5, 1.5], [0.0, -0.6, 0.0], 0.5));
    stage.materials = vec![
        glass(&[
            ("ior", &[1.33]),
            ("priority", &[5.0]),
            ("transmissionColor", &water),
            ("transmissionDepth", &[1.0]),
        ]),
        dielectric(1.5, -5.0),
        matte([0.5; 3]),
    ];
    stage.meshes = vec![
        cube(3.0, 0),
        Mesh::floor(2.0)
            .with_material(2)
            .placed(DAffine3::from_translation(DVec3::new(0.0, -0.8, 0.0))),
        Mesh::cube_face(4).with_material(2),
    ];
    if with_bubble {
        stage.meshes.push(cube(0.5, 1));
        stage.meshes.push(cube(0.2, 1));
    }
    stage.lights.push(light);
    stage.render(|s| *s = settings())
}

#[test]
fn light_passes_hidden_boundaries() {
    let tube = LightShape::Cylinder {
        radius: 0.2,
        length: 1.0,
    };
    let place = DMat4::from_translation(DVec3::new(0.0, 0.9, 0.0));
    for (name, light) in [
        ("rect", rect_light(1.5, 1.5, 0.9)),
        ("cylinder", light(tube, place)),
    ] {
        let (with, without) = (under_water(true, light.clone()), under_water(false, light));
        assert!(without.mean() > 1e-3, "{name} is dark");
        check_near(with.mean(), without.mean(), 1e-3, name);
        assert!(rel_mse(&with, &without) < 1e-3, "{name}");
        assert_eq!(with.stats.rays.shadow, without.stats.rays.shadow, "{name}");
    }
}

#[test]
fn more_media_than_a_path_carries_are_a_warning() {
    let render = |n: u32| {
        let materials = (0..n).map(|i| dielectric(1.0, i as f32));
        let meshes = (0..n).map(|i| cube(1.0 - 0.05 * f64::from(i), i));
        let mut stage = stage(materials.collect(), meshes.collect());
        stage.lights.push(dome());
        render(&stage)
    };
    let (few, many) = (render(8), render(12));
    assert_eq!(few.stats.warnings, [""; 0]);
    let [warning] = &many.stats.warnings[..] else {
        panic!("{:?}", many.stats.warnings);
    };
    assert!(warning.contains("too many media"), "{warning}");
    check_near(many.mean(), 1.0, 1e-3, "many");
}
