//! Glints of a sun, smaller than a pixel.

use kilauea_math::Spectrum;
use kilauea_render::Conditions;
use kilauea_scene::{Light, LightShape, RenderSettings, Shading};
use kilauea_testing::Moments;
use kilauea_tests::{Mesh, Picture, Stage, facing_down, light, perspective, preview};
use std::f64::consts::PI;

const HALF_WIDTH: f64 = 0.16;
const REFLECTANCE: [f32; 3] = [0.9, 0.8, 0.7];
const SUN_DEGREES: f64 = 0.4;

/// A mirror, seen from above, that shows a sun above the camera: a sixth of a pixel in radius, where four
/// pixels meet.
fn stage() -> Stage {
    let mut stage = Stage::new(perspective([0.0, 2.0, 0.0], [0.0; 3], HALF_WIDTH));
    stage.materials = vec![preview(&[
        ("diffuseColor", &REFLECTANCE),
        ("metallic", &[1.0]),
        ("roughness", &[0.0]),
    ])];
    stage.meshes.push(Mesh::floor(2.0));
    stage.lights.push(Light {
        radiance: Spectrum::splat(sun_radiance() as f32),
        ..light(
            LightShape::Distant {
                angle_degrees: SUN_DEGREES,
            },
            facing_down(0.0, 0.0, 0.0),
        )
    });
    stage
}

/// So that it has an irradiance of pi.
fn sun_radiance() -> f64 {
    (0.5 * SUN_DEGREES).to_radians().sin().powi(-2)
}

fn settings() -> RenderSettings {
    RenderSettings {
        resolution: [16, 16],
        samples_per_pixel: 16,
        max_depth: 4,
        ..Stage::settings()
    }
}

/// The film sees the sun's disk as large as it is, near its middle.
#[test]
fn a_glint_has_its_light_with_a_small_part_of_its_variance() {
    let settings = settings();
    let prepared = stage().prepare(&settings);
    let mean = |seed| {
        let settings = RenderSettings {
            seed,
            ..settings.clone()
        };
        Picture::render(&prepared, settings).mean()
    };
    let n_seeds = 96;
    let moments = Moments::of(&(1..=n_seeds).map(mean).collect::<Vec<_>>());

    let reflectance = REFLECTANCE.map(f64::from).iter().sum::<f64>() / 3.0;
    let expected = reflectance * PI / (2.0 * HALF_WIDTH).powi(2);
    let error_sq = moments.variance / f64::from(n_seeds);
    assert!(
        (moments.mean - expected).powi(2) < 16.0 * error_sq,
        "{moments:?} for {expected}"
    );

    // Of independent samples that find it or do not, four pixels of 256 with as many each.
    let n_samples = f64::from(settings.samples_per_pixel * 16 * 16);
    let by_chance = expected * reflectance * sun_radiance() / n_samples;
    assert!(
        moments.variance < 0.35 * by_chance,
        "{moments:?} for {by_chance}"
    );
}

#[test]
fn how_it_is_run_does_not_change_a_bit() {
    let settings = RenderSettings {
        resolution: [40, 24],
        samples_per_pixel: 6,
        ..settings()
    };
    let prepared = stage().prepare(&settings);
    let render = |conditions, shading, threads| {
        let settings = RenderSettings {
            shading,
            threads,
            ..settings.clone()
        };
        Picture::render_under(conditions, &prepared, settings)
    };
    let inline = render(Conditions::default(), Shading::Inline, 1);
    let plain_loop = Conditions {
        plain_loop: true,
        ..Conditions::default()
    };
    for (what, conditions, shading, threads) in [
        ("seven threads", Conditions::default(), Shading::Inline, 7),
        ("a plain loop", plain_loop, Shading::Inline, 2),
        ("queues", Conditions::default(), Shading::Queued, 2),
        ("bytes", Conditions::default(), Shading::Bytes, 2),
    ] {
        inline.check_same_bits(&render(conditions, shading, threads), what);
    }
}

/// Nothing shows the sun, or there is none.
#[test]
fn pixels_without_glints_have_no_more_paths_than_samples() {
    let n_camera_rays = |stage: &Stage| {
        let settings = settings();
        let prepared = stage.prepare(&settings);
        Picture::render(&prepared, settings).stats.rays.camera
    };
    let mut matte = stage();
    matte.materials = vec![kilauea_tests::matte([0.5; 3])];
    // One for each pixel tells whether there is a glint.
    assert_eq!(n_camera_rays(&matte), 17 * 16 * 16);
    let mut without_sun = stage();
    without_sun.lights.clear();
    assert_eq!(n_camera_rays(&without_sun), 16 * 16 * 16);
}
