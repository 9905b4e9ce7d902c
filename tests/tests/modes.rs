//! However a frame is rendered, it is the same frame.

use kilauea_math::{DAffine3, DMat4, DVec3, Spectrum};
use kilauea_mesh::CurveType;
use kilauea_render::{Broadcast, Conditions, Packing, PreparedScene, RenderError, RenderJob};
use kilauea_scene::{
    DataWindow, FilterKind, Integrator, Light, LightShape, RenderSettings, Shading, Visibility,
};
use kilauea_tests::{
    Curves, Mesh, Picture, Placements, Points, Stage, black_emitter, facing_down, glass, light,
    matte, preview, rect_light, rel_mse, with_opacity,
};
use std::sync::Arc;
use std::time::Duration;

/// A room that uses every feature: cutouts, glass, liquid in glass, meshes that shine, area lights, a dome, a sun,
/// instances that move, curves, points, a roof that the camera does not see, and a lens.
fn everything() -> Stage {
    let mut stage = plain();
    stage.camera.lens_radius = 0.02;
    stage.camera.focus_distance = 3.0;
    stage.materials.extend([
        with_opacity(matte([0.2, 0.6, 0.3]), 0.5),
        black_emitter(2.0),
        preview(&[("opacity", &[0.0]), ("roughness", &[0.0])]),
        glass(&[("priority", &[1.0])]),
        glass(&[
            ("ior", &[1.33]),
            ("transmissionColor", &[0.9, 0.5, 0.2]),
            ("transmissionDepth", &[0.1]),
        ]),
    ]);
    stage.spheres[0].material = 4;
    for (half, material) in [(0.2, 5), (0.15, 6)] {
        let place = DAffine3::from_translation(DVec3::new(0.9, 0.2, 0.9));
        let place = place * DAffine3::from_scale(DVec3::splat(half));
        stage
            .meshes
            .push(Mesh::cube().placed(place).with_material(material));
    }
    let small = DAffine3::from_scale(DVec3::splat(0.2));
    stage.prototypes.push("/Prototype".into());
    stage
        .meshes
        .push(Mesh::cube().in_prototype(1).with_material(2).placed(small));
    let places = [DVec3::new(-0.7, 0.2, 0.4), DVec3::new(0.8, 0.5, -0.3)];
    stage.instances.push(Placements {
        parent: 0,
        prototype: 1,
        parent_from_prototype: places.map(DAffine3::from_translation).to_vec(),
        primvar: None,
        later: vec![
            places
                .map(|p| DAffine3::from_translation(p + 0.1 * DVec3::Y))
                .to_vec(),
        ],
    });
    let strand = [[-0.9, 0.0, 0.6], [-0.8, 0.5, 0.7], [-0.9, 1.0, 0.5]];
    stage
        .curves
        .push(Curves::new(CurveType::Cubic, &strand, 0.05));
    stage.points.push(Points::new(&[[0.5, 0.2, 0.8]], 0.2));
    let roof = Mesh::floor(0.3).placed(DAffine3::from_translation(DVec3::Y));
    let unseen = Visibility::SHADOW | Visibility::INDIRECT;
    stage.meshes.push(roof.met_by(unseen));
    let triangle = [[-1.5, 0.5, -0.5], [-1.5, 0.5, 0.5], [-1.5, 1.0, 0.0]];
    stage.meshes.push(Mesh::polygon(&triangle).with_material(3));
    stage.lights.push(Light {
        radiance: Spectrum::new(0.1, 0.2, 0.4),
        ..light(LightShape::Dome, DMat4::IDENTITY)
    });
    // Bright enough to be aimed at where glass mirrors it.
    let sun = LightShape::Distant { angle_degrees: 4.0 };
    let aslant = DMat4::from_rotation_z(0.4) * facing_down(0.0, 0.0, 0.0);
    stage.lights.push(Light {
        radiance: Spectrum::splat(20.0),
        ..light(sun, aslant)
    });
    stage
}

/// A glossy sphere on a floor under a rect light.
fn plain() -> Stage {
    let mut stage = Stage::sphere_on_floor();
    stage.lights.push(rect_light(1.0, 1.0, 2.0));
    stage
}

fn settings() -> RenderSettings {
    RenderSettings {
        // Not a multiple of the tiles.
        resolution: [72, 40],
        samples_per_pixel: 6,
        filter: FilterKind::BlackmanHarris,
        ..Stage::settings()
    }
}

#[test]
fn threads_do_not_change_a_bit() {
    let prepared = everything().prepare(&settings());
    let render = |threads| {
        let settings = RenderSettings {
            threads,
            ..settings()
        };
        Picture::render(&prepared, settings)
    };
    let one = render(1);
    assert!(one.mean() > 0.05);
    for threads in [2, 3, 1] {
        one.check_same_bits(&render(threads), &format!("{threads} threads"));
    }
    // More threads than tiles: passes over a tile still come in order.
    let tiny = |threads| {
        let settings = RenderSettings {
            threads,
            resolution: [8, 8],
            samples_per_pixel: 64,
            ..settings()
        };
        Picture::render(&prepared, settings)
    };
    tiny(1).check_same_bits(&tiny(3), "one tile for three threads");
}

/// Answers come late and in any order.
const LATE: Conditions = Conditions {
    plain_loop: false,
    first_come: false,
    answer_delay_ms: 2.0,
    broadcast: Broadcast::Culled,
    packing: Packing::Plain,
    sample_one_in: 0,
};

/// Renders in a plain loop and in every way of the engine, which must not change a bit.
fn check_shading(name: &str, stage: &Stage) {
    let settings = RenderSettings {
        samples_per_pixel: 3,
        ..settings()
    };
    let prepared = stage.prepare(&settings);
    let render_under = |conditions, shading, threads| {
        let settings = RenderSettings {
            shading,
            threads,
            ..settings.clone()
        };
        Picture::render_under(conditions, &prepared, settings)
    };
    let render = |shading, threads| render_under(Conditions::default(), shading, threads);
    let inline = render(Shading::Inline, 2);
    assert!(inline.mean() > 0.01, "{name} is black");
    assert_eq!(inline.stats.memory.shades_in_flight_peak, 0);
    let plain_loop = Conditions {
        plain_loop: true,
        ..Conditions::default()
    };
    let plain = render_under(plain_loop, Shading::Inline, 2);
    plain.check_same_bits(&inline, &format!("{name}, plain loop"));
    let late = render_under(LATE, Shading::Queued, 2);
    inline.check_same_bits(&late, &format!("{name}, answers up to 2 ms late"));
    for (shading, threads) in [
        (Shading::Queued, 1),
        (Shading::Queued, 2),
        (Shading::Queued, 7),
        (Shading::Bytes, 2),
    ] {
        let what = format!("{name}, {shading:?}, {threads} threads");
        let picture = render(shading, threads);
        inline.check_same_bits(&picture, &what);
        let (ours, theirs) = (&inline.stats, &picture.stats);
        assert_eq!(ours.rays.camera, theirs.rays.camera, "{what}");
        assert_eq!(ours.rays.shadow, theirs.rays.shadow, "{what}");
        assert_eq!(ours.rays.indirect, theirs.rays.indirect, "{what}");
        assert!(theirs.is_complete && theirs.full_passes == ours.full_passes);
        assert!(theirs.memory.shades_in_flight_peak > 0, "{what}");
    }
}

#[test]
fn how_questions_are_answered_does_not_change_a_bit() {
    check_shading("plain", &plain());
    // Cut-outs, instances that move, curves, points, a lens.
    check_shading("everything", &everything());
    let mut cutout = plain();
    cutout.materials[1] = with_opacity(matte([0.2, 0.6, 0.3]), 0.5);
    check_shading("a cut-out sphere", &cutout);
    let mut furnace = plain();
    furnace.lights = vec![light(LightShape::Dome, DMat4::IDENTITY)];
    check_shading("under a dome", &furnace);
}

#[test]
fn shades_that_wait_keep_within_their_memory() {
    let mut peaks = [1_u64 << 16, 1 << 24].map(|shade_memory_bytes| {
        let picture = everything().render(|s| {
            *s = RenderSettings {
                shading: Shading::Queued,
                threads: 2,
                shade_memory_bytes,
                ..settings()
            };
        });
        picture.stats.memory.shades_in_flight_peak
    });
    peaks.sort_unstable();
    let [little, much] = peaks;
    // One root a thread may pass the budget.
    assert!(little < (1 << 16) + 2 * 4096, "{little} bytes");
    assert!(much > 4 * little, "{little} {much}");
}

#[test]
fn a_shader_that_panics_ends_the_render_and_is_named() {
    let lamps = |n: usize| {
        let mut stage = plain();
        let mut emitter = black_emitter(2.0);
        emitter.path = "/Looks/Lamp".into();
        stage.materials.push(emitter);
        let corners: Vec<[f32; 3]> = (0..n)
            .map(|i| std::f32::consts::TAU * i as f32 / n as f32)
            .map(|angle| [angle.cos(), 1.5 + angle.sin(), -1.0])
            .collect();
        stage.meshes.push(Mesh::polygon(&corners).with_material(2));
        stage.prepare(&settings())
    };
    // Emission of triangles that are not among the lights: no sound scene is like that.
    let into_inner = |prepared| Arc::into_inner(prepared).expect("nobody else has it");
    let broken: PreparedScene = PreparedScene {
        lights: into_inner(lamps(3)).lights,
        ..into_inner(lamps(64))
    };
    let broken = Arc::new(broken);
    for shading in [Shading::Inline, Shading::Queued, Shading::Bytes] {
        let settings = RenderSettings {
            shading,
            threads: 3,
            ..settings()
        };
        let job = RenderJob::start(Arc::clone(&broken), settings).unwrap();
        match job.finish().map(|_| ()) {
            Err(RenderError::ShaderPanicked { material, .. }) => {
                assert_eq!(material, "/Looks/Lamp", "{shading:?}");
            }
            other => panic!("{shading:?}: {other:?}"),
        }
    }
}

#[test]
fn skipping_what_is_not_needed_does_not_change_a_bit() {
    let mut dark = plain();
    dark.lights.clear();
    let mut only_dome = plain();
    only_dome.lights = vec![light(LightShape::Dome, DMat4::IDENTITY)];
    for (name, stage) in [
        ("everything", everything()),
        ("plain", plain()),
        ("dark", dark),
        ("only a dome", only_dome),
    ] {
        let prepared = stage.prepare(&settings());
        let render = |specialize| {
            let settings = RenderSettings {
                specialize,
                integrator: Integrator::Path,
                ..settings()
            };
            Picture::render(&prepared, settings)
        };
        let (special, general) = (render(true), render(false));
        special.check_same_bits(&general, name);
        assert!(general.stats.skipped.is_empty());
        // No scene of these has an image, and `path` learns nothing.
        let unused = ["textures", "guided_directions", "guided_lights"];
        let skips = special.stats.skipped != unused;
        assert_eq!(skips, name != "everything", "{name}");
    }
}

#[test]
fn another_seed_makes_another_picture_of_the_same() {
    let prepared = everything().prepare(&settings());
    let render = |seed| {
        let settings = RenderSettings {
            seed,
            samples_per_pixel: 64,
            ..settings()
        };
        Picture::render(&prepared, settings)
    };
    let (a, b) = (render(0), render(1));
    // The constant sky aside.
    let n_equal = (a.channel("R").iter().zip(b.channel("R")))
        .zip(a.channel("A"))
        .filter(|((a, b), alpha)| **alpha > 0.0 && a == b)
        .count();
    assert!(n_equal < 40, "{n_equal} pixels are the same");
    let ratio = a.mean() / b.mean();
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    assert!(rel_mse(&a, &b) < 0.2);
}

#[test]
fn a_crop_is_part_of_the_frame() {
    let prepared = everything().prepare(&settings());
    let full = Picture::render(&prepared, settings());
    let window = DataWindow {
        min: [19, 7],
        max: [61, 31],
    };
    let settings = RenderSettings {
        data_window: Some(window),
        ..settings()
    };
    let crop = Picture::render(&prepared, settings);
    assert_eq!(crop.image.size(), [42, 24]);
    for (name, bits) in crop.bits() {
        let whole = full.channel(name);
        for (idx, &bits) in bits.iter().enumerate() {
            let (x, y) = (19 + idx % 42, 7 + idx / 42);
            assert_eq!(bits, whole[y * 72 + x].to_bits(), "{name} at {x} {y}");
        }
    }
}

#[test]
fn overscan_surrounds_the_frame() {
    let prepared = plain().prepare(&settings());
    let full = Picture::render(&prepared, settings());
    let settings = RenderSettings {
        data_window: Some(DataWindow {
            min: [-3, -2],
            max: [74, 41],
        }),
        ..settings()
    };
    let wide = Picture::render(&prepared, settings);
    for (idx, value) in full.channel("G").iter().enumerate() {
        let (x, y) = (3 + idx % 72, 2 + idx / 72);
        assert_eq!(value.to_bits(), wide.channel("G")[y * 77 + x].to_bits());
    }
}

fn endless() -> RenderSettings {
    RenderSettings {
        samples_per_pixel: 1 << 16,
        resolution: [256, 256],
        threads: 2,
        ..settings()
    }
}

#[test]
fn a_time_limit_returns_what_there_is() {
    for shading in [Shading::Inline, Shading::Queued] {
        check_time_limit(&RenderSettings {
            shading,
            resolution: [64, 64],
            ..endless()
        });
    }
}

/// Doubles the limit until a pass fits, however slow the machine is; all passes never do.
fn check_time_limit(settings: &RenderSettings) {
    let prepared = everything().prepare(settings);
    let picture = (0..8)
        .map(|doublings| RenderSettings {
            time_limit_secs: Some(f64::from(1 << doublings)),
            ..settings.clone()
        })
        .map(|settings| Picture::render(&prepared, settings))
        .find(|picture| picture.stats.full_passes >= 1)
        .expect("two minutes are enough for 4096 pixels");
    assert!(!picture.stats.is_complete);
    assert!(picture.stats.samples_per_pixel >= 1.0);
    assert!(picture.channel("sample_count").iter().all(|&n| n >= 1.0));
    assert!(picture.mean() > 0.05);
}

#[test]
fn cancelling_stops_soon() {
    for shading in [Shading::Inline, Shading::Queued, Shading::Bytes] {
        check_cancelling(RenderSettings {
            shading,
            ..endless()
        });
    }
}

fn check_cancelling(settings: RenderSettings) {
    const LONG: Duration = Duration::from_mins(1);
    let prepared = everything().prepare(&settings);
    let job = RenderJob::start(Arc::clone(&prepared), settings).expect("the settings are sound");
    while job.progress().0 == 0.0 {
        assert!(!job.wait(Duration::from_millis(10)));
    }
    job.cancel();
    assert!(job.wait(LONG), "the samples would take hours");
    let picture = Picture::finish(job, &prepared);
    assert!(!picture.stats.is_complete);
    assert!(picture.stats.samples > 0);
}

#[test]
fn layers_add_up_to_the_beauty() {
    let picture = everything().render(|s| *s = settings());
    let parts = [
        "emission",
        "direct_diffuse",
        "direct_specular",
        "indirect_diffuse",
        "indirect_specular",
    ];
    for channel in ["R", "G", "B"] {
        let names = parts.map(|part| format!("{part}.{channel}"));
        let layers = names.each_ref().map(|name| picture.channel(name));
        for (name, layer) in names.iter().zip(&layers) {
            assert!(layer.iter().any(|&v| v > 0.0), "{name} is empty");
        }
        for (idx, &beauty) in picture.channel(channel).iter().enumerate() {
            let sum: f32 = layers.iter().map(|layer| layer[idx]).sum();
            let error = (sum - beauty).abs();
            assert!(
                error <= 2e-6 * beauty.max(1.0),
                "{channel} {idx}: {sum} {beauty}"
            );
        }
    }
}

#[test]
fn only_the_layers_asked_for_are_there_and_alike() {
    let all = plain().render(|s| *s = settings());
    let some = plain().render(|s| {
        *s = settings();
        s.aovs = vec!["Z".into(), "albedo".into()];
    });
    let names: Vec<&str> = some
        .image
        .channels
        .iter()
        .map(|c| c.name.as_str())
        .collect();
    assert_eq!(
        names,
        ["R", "G", "B", "A", "Z", "albedo.R", "albedo.G", "albedo.B"]
    );
    for name in names {
        assert_eq!(all.channel(name), some.channel(name), "{name}");
    }
}
