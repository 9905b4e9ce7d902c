//! Enclosures and objects in which radiance is one everywhere.

use kilauea_math::DMat4;
use kilauea_scene::{LightShape, Material};
use kilauea_tests::{
    Mesh, Sphere, Stage, black_emitter, check_near, light, matte, perspective, preview,
    with_opacity,
};

/// A box of albedo one half, with lights of radiance one half that cover its walls.
#[test]
fn closed_lambert_box_with_lights_on_its_walls() {
    let stage = Stage::box_of_light(matte([0.5; 3]));
    let mean = stage.render(|s| s.samples_per_pixel = 1024).mean();
    // The standard deviation is 0.0007.
    check_near(mean, 1.0, 3e-3, "box");
    // Without a limit on depth 1/2 + 1/4 + ...; after n bounces 1 - 2^-(n + 1).
    for (depth, expected) in [(0, 0.5), (1, 0.75), (2, 0.875)] {
        let mean = stage.render(|s| s.max_depth = depth).mean();
        check_near(mean, expected, 5e-3, &format!("depth {depth}"));
    }
}

/// A white sphere; half of all rays meet a shell of radiance one before it.
#[test]
fn closed_lambert_sphere_with_a_half_present_emitter() {
    let mut stage = Stage::new(perspective([0.3, 0.2, 0.5], [0.0, 0.0, -1.0], 1.0));
    stage.materials = vec![matte([1.0; 3]), with_opacity(black_emitter(1.0), 0.5)];
    for (radius, material) in [(1.0, 0), (0.9, 1)] {
        stage.spheres.push(Sphere {
            center: [0.0; 3],
            radius,
            material,
        });
    }
    let picture = stage.render(|s| {
        s.max_depth = 64;
        s.samples_per_pixel = 256;
    });
    check_near(picture.mean(), 1.0, 2e-3, "sphere");
}

/// Three white walls, three that shine with radiance one.
#[test]
fn closed_box_of_white_and_emissive_walls() {
    let mut stage = Stage::new(perspective([0.3, 0.2, 0.5], [0.0, 0.0, -1.0], 1.0));
    stage.materials = vec![matte([1.0; 3]), black_emitter(1.0)];
    for face in 0..6 {
        stage
            .meshes
            .push(Mesh::cube_face(face).with_material(face as u32 % 2));
    }
    let picture = stage.render(|s| {
        s.max_depth = 64;
        s.samples_per_pixel = 1024;
    });
    // The standard deviation is 0.0006.
    check_near(picture.mean(), 1.0, 3e-3, "box");
}

/// Mean radiance of the disk that a sphere covers, in a dome of radiance one.
fn sphere_in_dome(material: Material) -> f64 {
    let mut stage = Stage::new(perspective([0.0, 0.0, 3.0], [0.0; 3], 0.4));
    stage.materials.push(material);
    stage.spheres.push(Sphere {
        center: [0.0; 3],
        radius: 1.0,
        material: 0,
    });
    stage.lights.push(light(LightShape::Dome, DMat4::IDENTITY));
    let picture = stage.render(|s| {
        s.max_depth = 64;
        s.samples_per_pixel = 256;
    });
    let covered = picture.mean_of("A");
    check_near(covered, std::f64::consts::PI / 8.0 / 0.64, 0.01, "cover");
    (picture.mean() - (1.0 - covered)) / covered
}

#[test]
fn white_lambert_sphere_in_a_dome() {
    check_near(sphere_in_dome(matte([1.0; 3])), 1.0, 2e-3, "white");
    check_near(sphere_in_dome(matte([0.3; 3])), 0.3, 2e-3, "gray");
}

#[test]
fn preview_surfaces_in_a_dome_make_no_light() {
    let white: (&str, &[f32]) = ("diffuseColor", &[1.0; 3]);
    for metallic in [0.0, 0.5, 1.0] {
        for roughness in [0.0, 0.2, 0.5, 1.0] {
            for clearcoat in [0.0, 1.0] {
                let mean = sphere_in_dome(preview(&[
                    white,
                    ("metallic", &[metallic]),
                    ("roughness", &[roughness]),
                    ("clearcoat", &[clearcoat]),
                    ("clearcoatRoughness", &[0.1]),
                ]));
                let what = format!("metallic {metallic} roughness {roughness} coat {clearcoat}");
                assert!(mean <= 1.002, "{what}: {mean}");
                // Half a metal takes half of what its interface lets in; else nothing absorbs.
                assert!(metallic == 0.5 || mean >= 0.97, "{what}: {mean}");
            }
        }
    }
    for specular in [0.0, 0.3, 1.0] {
        for roughness in [0.05, 0.6] {
            let mean = sphere_in_dome(preview(&[
                white,
                ("useSpecularWorkflow", &[1.0]),
                ("specularColor", &[specular; 3]),
                ("roughness", &[roughness]),
            ]));
            assert!(
                (0.97..=1.002).contains(&mean),
                "specular {specular} roughness {roughness}: {mean}"
            );
        }
    }
}

#[test]
fn glass_in_a_dome_is_invisible() {
    for (ior, roughness) in [(1.5, 0.0), (1.5, 0.4), (1.1, 0.0), (2.4, 0.0), (1.0, 0.0)] {
        let mean = sphere_in_dome(preview(&[
            ("diffuseColor", &[1.0; 3]),
            ("opacity", &[0.0]),
            ("ior", &[ior]),
            ("roughness", &[roughness]),
        ]));
        check_near(mean, 1.0, 2e-3, &format!("ior {ior} roughness {roughness}"));
    }
}
