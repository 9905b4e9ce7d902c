//! Glass in glass, with hardly anything between.

use kilauea_math::DMat4;
use kilauea_scene::{LightShape, Material};
use kilauea_tests::{Sphere, Stage, check_near, light, perspective, preview};

fn clear(ior: f32) -> Material {
    preview(&[
        ("diffuseColor", &[1.0; 3]),
        ("opacity", &[0.0]),
        ("ior", &[ior]),
        ("roughness", &[0.0]),
    ])
}

/// What is clear and loses nothing cannot be seen in a white sky, however its parts touch.
#[test]
fn spheres_a_millionth_apart_are_invisible_in_a_white_sky() {
    for (what, gap) in [
        ("a gap of 1e-6", 1e-6),
        ("a gap of 1e-4", 1e-4),
        ("no gap", 0.0),
        ("an overlap of 1e-6", -1e-6),
    ] {
        let mut stage = Stage::new(perspective([0.0, 0.0, 3.0], [0.0; 3], 0.4));
        stage.materials = vec![clear(1.5), clear(1.33)];
        for (radius, material) in [(1.0, 0), (0.8, 0), (0.8 * (1.0 - gap), 1)] {
            stage.spheres.push(Sphere {
                center: [0.0; 3],
                radius,
                material,
            });
        }
        stage.lights.push(light(LightShape::Dome, DMat4::IDENTITY));
        let picture = stage.render(|s| {
            s.max_depth = 128;
            s.samples_per_pixel = 64;
        });
        picture.check_finite(what);
        let most = picture.channel("R").iter().copied().fold(0.0, f32::max);
        check_near(picture.mean(), 1.0, 2e-3, what);
        super::report("dielectrics", format!("{what}: mean"), picture.mean());
        super::report("dielectrics", format!("{what}: brightest pixel"), most);
    }
}
