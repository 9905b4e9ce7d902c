//! Coordinates and radii over sixteen orders of magnitude (after the `pExp` of pbrt's tests).

use kilauea_math::hash::{mix32, unit_f32};
use kilauea_math::{DAffine3, DMat4, DVec3, Spectrum};
use kilauea_scene::{Camera, Light, LightShape, RenderSettings};
use kilauea_tests::{Mesh, Picture, Points, Stage, light, matte, perspective};

use super::white;

/// ± 10^x for x uniform in [−8, 8].
fn magnitude(number: u32) -> f32 {
    let exponent = 16.0 * unit_f32(mix32(2 * number)) - 8.0;
    let sign = if mix32(2 * number + 1) & 1 == 0 {
        1.0
    } else {
        -1.0
    };
    sign * 10.0_f32.powf(exponent)
}

fn point(number: u32) -> [f32; 3] {
    [0, 1, 2].map(|axis| magnitude(3 * number + axis))
}

fn radius(number: u32) -> f32 {
    magnitude(number).abs()
}

/// Triangles, points and sphere lights of every size and place.
fn wild() -> Stage {
    let camera = perspective([0.0, 0.0, 3.0], [0.0; 3], 1.0);
    let mut stage = Stage::new(Camera {
        clipping_range: [1e-9, 1e9],
        ..camera
    });
    stage.materials = vec![matte([0.8; 3])];
    let n = 300;
    stage.meshes.push(Mesh::new(
        (0..3 * n).map(point).collect(),
        vec![3; n as usize],
        (0..3 * n as i32).collect(),
    ));
    let centers: Vec<[f32; 3]> = (0..100).map(|i| point(10_000 + i)).collect();
    let mut points = Points::new(&centers, 1.0);
    points.widths = (0..100).map(|i| radius(20_000 + i)).collect();
    stage.points.push(points);
    stage.lights = (0..50)
        .map(|i| {
            let center = DVec3::from_array(point(30_000 + i).map(f64::from));
            let shape = LightShape::Sphere {
                radius: f64::from(radius(40_000 + i)),
            };
            Light {
                visible_to_camera: false,
                ..light(shape, DMat4::from_translation(center))
            }
        })
        .collect();
    stage.lights.push(Light {
        radiance: Spectrum::splat(0.5),
        ..light(LightShape::Dome, DMat4::IDENTITY)
    });
    stage
}

#[test]
fn sizes_from_1e_minus_8_to_1e8_together() {
    let settings = RenderSettings {
        resolution: [16, 16],
        samples_per_pixel: 8,
        ..Stage::settings()
    };
    let (prepared, warnings) = wild().prepare_damaged(&settings);
    let render = |threads| {
        let settings = RenderSettings {
            threads,
            ..settings.clone()
        };
        Picture::render_damaged(&prepared, settings)
    };
    let picture = render(1);
    picture.check_finite("wild");
    picture.check_same_bits(&render(3), "three threads");
    let stats = &picture.stats;
    assert_eq!((stats.invalid_samples, stats.invalid_rays), (0, 0));
    assert!(picture.mean_of("A") > 0.5, "{}", picture.mean_of("A"));
    super::report("magnitudes", "warnings", warnings.len());
    super::report("magnitudes", "covered", picture.mean_of("A"));
    super::report("magnitudes", "mean", picture.mean());
}

#[test]
fn white_cubes_of_any_size_vanish() {
    for exponent in [-8, -6, -4, 0, 4, 6, 8] {
        let size = 10.0_f64.powi(exponent);
        let camera = perspective([0.0, size, 3.0 * size], [0.0; 3], 0.6);
        let mut stage = white::stage(Camera {
            clipping_range: [1e-3 * size, 1e3 * size],
            ..camera
        });
        let place = DAffine3::from_rotation_y(0.5) * DAffine3::from_scale(DVec3::splat(size));
        stage.meshes.push(Mesh::cube().placed(place));
        let most = white::check(&stage, 0.3, 1e-5, &format!("1e{exponent}"));
        super::report(
            "magnitudes",
            format!("white cube of 1e{exponent}, off by"),
            most,
        );
    }
}

#[test]
fn points_of_any_radius_vanish_in_a_white_sky() {
    for exponent in [-8, -4, 0, 4, 8] {
        let radius = 10.0_f64.powi(exponent);
        let camera = perspective([0.0, radius, 3.0 * radius], [0.0; 3], 0.4);
        let mut stage = white::stage(Camera {
            clipping_range: [1e-3 * radius, 1e3 * radius],
            ..camera
        });
        stage
            .points
            .push(Points::new(&[[0.0; 3]], 2.0 * radius as f32));
        let most = white::check(&stage, 0.3, 1e-5, &format!("1e{exponent}"));
        super::report(
            "magnitudes",
            format!("white point of 1e{exponent}, off by"),
            most,
        );
    }
}
