//! Radiance with a closed form, in every way that a frame can be rendered.
//!
//! Each way is rendered with several seeds. Their spread says how far off their mean may be, so
//! that no tolerance hides an error which the samples could show.

#![forbid(unsafe_code)]

mod scenes;

use kilauea_math::Spectrum;
use kilauea_render::PreparedScene;
use kilauea_scene::{FilterKind, RenderSettings, Shading};
use kilauea_testing::{Family, Moments};
use kilauea_tests::{Mesh, Picture, Stage, black_emitter};
use scenes::{Known, SCENES, known, rect};
use std::sync::Arc;

const N_SEEDS: u32 = 10;
/// Relative error of what is not drawn: floors are seen around the point of the formula, and light
/// is added in `f32`.
const RESOLUTION: f64 = 3e-5;

/// Samplers differ in how many samples they are made for.
const SAMPLES_PER_PIXEL: [u32; 3] = [1, 4, 16];
const FILTERS: [(FilterKind, Option<f32>); 4] = [
    (FilterKind::Box, None),
    (FilterKind::Gaussian, None),
    (FilterKind::BlackmanHarris, None),
    (FilterKind::BlackmanHarris, Some(3.0)),
];

/// The mean of the picture for each seed: as many samples, in few pixels or many.
fn means(prepared: &Arc<PreparedScene>, settings: &RenderSettings) -> Vec<f64> {
    let side = match settings.samples_per_pixel {
        0..4 => 32,
        4..16 => 16,
        _ => 8,
    };
    let render = |seed| {
        let settings = RenderSettings {
            seed,
            resolution: [side, side],
            aovs: vec!["Z".into()],
            ..settings.clone()
        };
        Picture::render(prepared, settings).mean()
    };
    (0..N_SEEDS).map(render).collect()
}

fn p_value(known: &Known, settings: &RenderSettings) -> f64 {
    let prepared = known.stage.prepare(settings);
    let settings = RenderSettings {
        max_depth: known.max_depth,
        ..settings.clone()
    };
    let means = Moments::of(&means(&prepared, &settings));
    means.p_value(known.radiance, RESOLUTION * known.radiance)
}

#[test]
fn formulas_are_those_of_the_stages() {
    let listed = include_str!("../../scenes/analytic.json");
    let listed: serde_json::Value = serde_json::from_str(listed).expect("it is JSON");
    let listed = listed.as_object().expect("it is an object");
    for (stage, entry) in listed {
        let name = stage.trim_end_matches(".usda");
        let radiance = entry["radiance"].as_f64().expect("it is a number");
        let formula = known(name).radiance;
        let error = formula / radiance - 1.0;
        assert!(error.abs() < 1e-6, "{name}: {formula}, listed {radiance}");
    }
}

#[test]
fn every_filter_and_sampler_gives_the_radiance() {
    let mut family = Family::new("filters and samplers");
    for (name, _) in SCENES {
        let known = known(name);
        for samples_per_pixel in SAMPLES_PER_PIXEL {
            for (filter, filter_radius) in FILTERS {
                let settings = RenderSettings {
                    samples_per_pixel,
                    filter,
                    filter_radius,
                    ..Stage::settings()
                };
                let case = format!("{name}, {samples_per_pixel} samples, {filter:?}");
                family.add(case, p_value(&known, &settings));
            }
        }
    }
    family.check();
}

#[test]
fn every_way_of_shading_gives_the_radiance() {
    let mut family = Family::new("ways of shading");
    for (name, _) in SCENES {
        let known = known(name);
        for (shading, specialize) in [
            (Shading::Inline, false),
            (Shading::Queued, true),
            (Shading::Bytes, true),
        ] {
            let settings = RenderSettings {
                samples_per_pixel: 4,
                shading,
                specialize,
                ..Stage::settings()
            };
            family.add(format!("{name}, {shading:?}"), p_value(&known, &settings));
        }
    }
    family.check();
}

/// p-value of a floor under the rect light after a change.
fn with_fault(change: impl FnOnce(&mut Stage)) -> f64 {
    let mut faulty = known("plane_rect");
    change(&mut faulty.stage);
    let settings = RenderSettings {
        samples_per_pixel: 16,
        ..Stage::settings()
    };
    p_value(&faulty, &settings)
}

#[test]
fn half_a_percent_of_light_is_found() {
    assert!(with_fault(|_| ()) > 1e-3);
    for factor in [0.995_f32, 1.005] {
        let p = with_fault(|stage| stage.lights[0].radiance *= factor);
        assert!(p < 1e-6, "{factor}: {p}");
    }
    let p = with_fault(|stage| stage.lights[0].radiance *= Spectrum::new(1.0, 1.0, 1.015));
    assert!(p < 1e-6, "blue: {p}");
}

#[test]
fn a_missing_corner_is_found() {
    // A mesh in place of the light, whole and without a twentieth of its area.
    let mesh = |cut: f32| {
        let [x, y, z] = [0.5, 1.0, 1.0];
        let corners = [
            [-x, y, z],
            [-x, y, -z],
            [x, y, -z],
            [x, y, z - 2.0 * cut],
            [x - cut, y, z],
        ];
        with_fault(|stage| {
            stage.lights.clear();
            let light = Mesh::polygon(&corners).with_material(1);
            stage.meshes.push(light);
            stage.materials.push(black_emitter(rect::RADIANCE as f32));
        })
    };
    assert!(mesh(1e-4) > 1e-3);
    assert!(mesh(0.3) < 1e-6);
}

#[test]
fn seeds_that_repeat_are_found() {
    // Ten times the same picture has no spread, and no picture is exactly right.
    let known = known("plane_rect");
    let settings = RenderSettings {
        samples_per_pixel: 1,
        resolution: [8, 8],
        ..Stage::settings()
    };
    let prepared = known.stage.prepare(&settings);
    let mean = Picture::render(&prepared, settings).mean();
    let repeated = Moments::of(&[mean; N_SEEDS as usize]);
    assert_eq!(
        repeated.p_value(known.radiance, RESOLUTION * known.radiance),
        0.0
    );
}
