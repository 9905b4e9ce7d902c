//! Light that is no number: where it arose is said, and it is black.

use kilauea_math::{DMat4, DVec3, Spectrum};
use kilauea_scene::{Material, RenderSettings, Shading};
use kilauea_tests::{Mesh, Picture, Stage, matte, perspective, preview, rect_light};
use std::f64::consts::FRAC_PI_2;

/// A floor under a light; its left half glows.
fn half_glowing(emission: f32) -> Stage {
    let mut stage = Stage::new(perspective([0.0, 1.0, 0.0], [0.0, 0.0, 0.0], 0.9));
    let glowing = preview(&[("emissiveColor", &[emission; 3])]);
    stage.materials = vec![matte([0.5; 3]), named(glowing, "/Looks/Glow")];
    let half = |x0: f32, x1: f32| {
        Mesh::polygon(&[
            [x0, 0.0, 1.0],
            [x1, 0.0, 1.0],
            [x1, 0.0, -1.0],
            [x0, 0.0, -1.0],
        ])
    };
    stage.meshes = vec![half(0.0, 1.0), half(-1.0, 0.0).with_material(1)];
    stage.meshes[1].path = "/World/Glowing".into();
    stage.lights.push(rect_light(1.0, 1.0, 2.0));
    stage
}

fn named(material: Material, path: &str) -> Material {
    Material {
        path: path.into(),
        ..material
    }
}

fn check(stage: &Stage, step: &str, words: &[&str]) -> Picture {
    let (picture, warnings) = stage.render_damaged(|s| s.samples_per_pixel = 4);
    picture.check_finite(step);
    let stats = &picture.stats;
    let by_step = &stats.invalid_samples_by_step;
    assert!(by_step[step] > 0, "{step}: {by_step:?}");
    assert_eq!(by_step.values().sum::<u64>(), stats.invalid_samples);
    let line = warnings
        .iter()
        .find(|w| words.iter().all(|word| w.contains(word)));
    assert!(line.is_some(), "{words:?}: {warnings:?}");
    super::report("faults", step, by_step[step]);
    picture
}

#[test]
fn emission_beyond_all_numbers_is_black_and_named() {
    let words = [
        "because their emission",
        "first in pixel (0, 0), sample 0, after 0 bounces",
        "/World/Glowing",
        "/Looks/Glow",
    ];
    let picture = check(&half_glowing(f32::INFINITY), "emission", &words);
    // What the other half shows is there; that some of its light was lost is what is said.
    let row = &picture.channel("R")[..16];
    assert!(row[..8].iter().all(|&v| v == 0.0), "{row:?}");
    assert!(row[9..].iter().all(|&v| v > 0.0), "{row:?}");
}

/// Inputs of UsdPreviewSurface, and how many numbers each has.
const INPUTS: [(&str, usize); 10] = [
    ("diffuseColor", 3),
    ("specularColor", 3),
    ("useSpecularWorkflow", 1),
    ("metallic", 1),
    ("roughness", 1),
    ("clearcoat", 1),
    ("clearcoatRoughness", 1),
    ("opacity", 1),
    ("opacityThreshold", 1),
    ("ior", 1),
];

#[test]
fn shaders_make_something_of_any_number() {
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 3e38, -3e38, 0.0] {
        for (name, n_values) in INPUTS {
            for opacity in [1.0, 0.3] {
                let values = [value; 3];
                let mut inputs: Vec<(&str, &[f32])> = vec![(name, &values[..n_values])];
                let usual = [("useSpecularWorkflow", [1.0]), ("opacity", [opacity])];
                let others = usual.iter().filter(|(other, _)| *other != name);
                inputs.extend(others.map(|(name, values)| (*name, &values[..])));
                let mut stage = half_glowing(0.0);
                stage.materials[1] = preview(&inputs);
                let (picture, _) = stage.render_damaged(|s| {
                    s.resolution = [8, 8];
                    s.samples_per_pixel = 2;
                });
                let what = format!("{name} {value:e}, opacity {opacity}");
                picture.check_finite(&what);
                // Of numbers, every shader makes light that is one.
                assert!(
                    value.is_nan() || picture.stats.invalid_samples == 0,
                    "{what}"
                );
            }
        }
    }
}

#[test]
fn a_shader_that_makes_no_number_is_named() {
    let mut stage = half_glowing(0.0);
    let broken = preview(&[("opacity", &[f32::NAN])]);
    stage.materials[1] = named(broken, "/Looks/Broken");
    let words = ["their BSDF was", "/World/Glowing", "/Looks/Broken"];
    check(&stage, "bsdf", &words);
}

#[test]
fn a_light_that_overflows_is_found_where_it_is_sampled() {
    let mut stage = half_glowing(0.0);
    stage.lights[0].radiance = Spectrum::splat(3e38);
    // So close that its density is far below one.
    stage.lights[0].world_from_light.w_axis.y = 0.05;
    check(&stage, "light_sample", &["their light sample"]);
}

#[test]
fn parts_that_overflow_together_are_a_sum() {
    // The camera sees a light, and the surface behind it that glows.
    let mut stage = half_glowing(2e38);
    let upward = DMat4::from_rotation_x(FRAC_PI_2);
    stage.lights[0].world_from_light = DMat4::from_translation(0.5 * DVec3::Y) * upward;
    stage.lights[0].radiance = Spectrum::splat(2e38);
    check(&stage, "sum", &["their sum"]);
}

#[test]
fn exposure_is_the_last_step() {
    let mut stage = half_glowing(1e30);
    stage.camera.exposure_scale = 1e30;
    check(&stage, "exposure", &["their exposure"]);
}

#[test]
fn faults_are_the_same_however_a_frame_is_rendered() {
    let stage = half_glowing(f32::INFINITY);
    let settings = RenderSettings {
        resolution: [40, 40],
        samples_per_pixel: 4,
        ..Stage::settings()
    };
    let (prepared, _) = stage.prepare_damaged(&settings);
    let render = |threads, shading| {
        let settings = RenderSettings {
            threads,
            shading,
            ..settings.clone()
        };
        Picture::render_damaged(&prepared, settings)
    };
    let one = render(1, Shading::Inline);
    assert!(one.stats.invalid_samples > 1000);
    for (threads, shading) in [
        (3, Shading::Inline),
        (3, Shading::Queued),
        (2, Shading::Bytes),
    ] {
        let other = render(threads, shading);
        one.check_same_bits(&other, "with faults");
        assert_eq!(one.stats.warnings, other.stats.warnings);
        let by_step = |p: &Picture| p.stats.invalid_samples_by_step.clone();
        assert_eq!(by_step(&one), by_step(&other));
        // The second look at a path is no ray of the picture.
        assert_eq!(one.stats.rays.camera, other.stats.rays.camera);
    }
    assert_eq!(one.stats.rays.camera, 40 * 40 * 4);
}
