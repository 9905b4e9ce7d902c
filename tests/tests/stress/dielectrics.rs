//! Glass in glass, with hardly anything between.

use kilauea_math::DMat4;
use kilauea_scene::{LightShape, Material};
use kilauea_tests::{Picture, Sphere, Stage, check_near, light, perspective, preview};

fn clear(ior: f32) -> Material {
    preview(&[
        ("diffuseColor", &[1.0; 3]),
        ("opacity", &[0.0]),
        ("ior", &[ior]),
        ("roughness", &[0.0]),
    ])
}

/// Part glass and part gray metal: what crosses it loses light, so that every crossing counts.
fn dim() -> Material {
    preview(&[
        ("diffuseColor", &[1.0; 3]),
        ("metallic", &[0.2]),
        ("opacity", &[0.0]),
        ("ior", &[1.33]),
        ("roughness", &[0.0]),
    ])
}

/// Two spheres in a third under a white sky, the innermost smaller by a fraction of the next.
fn nested(gap: f64, innermost: Material) -> Picture {
    let mut stage = Stage::new(perspective([0.0, 0.0, 3.0], [0.0; 3], 0.4));
    stage.materials = vec![clear(1.5), innermost];
    for (radius, material) in [(1.0, 0), (0.8, 0), (0.8 * (1.0 - gap), 1)] {
        stage.spheres.push(Sphere {
            center: [0.0; 3],
            radius,
            material,
        });
    }
    stage.lights.push(light(LightShape::Dome, DMat4::IDENTITY));
    stage.render(|s| {
        s.max_depth = 128;
        s.samples_per_pixel = 64;
    })
}

/// What is clear and loses nothing cannot be seen, however its parts touch.
#[test]
fn clear_spheres_a_millionth_apart_are_invisible() {
    for (what, gap) in [
        ("a gap of 1e-4", 1e-4),
        ("a gap of 1e-6", 1e-6),
        ("no gap", 0.0),
        ("an overlap of 1e-6", -1e-6),
    ] {
        let picture = nested(gap, clear(1.33));
        picture.check_finite(what);
        check_near(picture.mean(), 1.0, 2e-3, what);
        super::report(
            "dielectrics",
            format!("clear, {what}: mean"),
            picture.mean(),
        );
    }
}

/// No crossing is missed, and none is met twice: a gap of a millionth is like one of a thousandth.
#[test]
fn dim_spheres_a_millionth_apart_are_as_dim_as_those_further_apart() {
    let mean = |gap| nested(gap, dim()).mean();
    let far = mean(1e-3);
    assert!(far < 0.9, "{far}");
    for gap in [1e-4, 1e-6] {
        let near = mean(gap);
        check_near(near, far, 5e-3, &format!("a gap of {gap}"));
        super::report(
            "dielectrics",
            format!("dim, gap of {gap}, over 1e-3"),
            near / far,
        );
    }
}
