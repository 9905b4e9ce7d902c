//! Work that is skipped since a scene has no use for it changes no bit of the picture.

use kilauea_math::{DMat4, Spectrum};
use kilauea_render::{PrepareOptions, PreparedScene, RenderError, RenderJob};
use kilauea_scene::{Integrator, Light, LightShape, RenderSettings};
use kilauea_tests::{Mesh, Picture, Stage, black_emitter, light, rect_light};
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::Arc;

/// A glossy sphere on a floor under some lights.
fn stage(lights: Vec<Light>) -> Stage {
    let mut stage = Stage::sphere_on_floor();
    stage.lights = lights;
    stage
}

fn dome() -> Light {
    light(LightShape::Dome, DMat4::IDENTITY)
}

fn parallel() -> Light {
    let shape = LightShape::Distant { angle_degrees: 0.0 };
    Light {
        radiance: Spectrum::splat(3.0),
        ..light(shape, DMat4::from_rotation_x(-1.0))
    }
}

fn settings() -> RenderSettings {
    RenderSettings {
        // What `kilauea` learns is no skip: without it the image is another, as good one.
        integrator: Integrator::Path,
        resolution: [24, 16],
        samples_per_pixel: 4,
        ..Stage::settings()
    }
}

/// Renders with every skip, then without each of them; returns their names.
fn check_skips(what: &str, stage: &Stage, settings: &RenderSettings) -> Vec<Cow<'static, str>> {
    let prepared = stage.prepare(settings);
    let special = Picture::render(&prepared, settings.clone());
    for name in &special.stats.skipped {
        let settings = RenderSettings {
            general: vec![name.to_string()],
            ..settings.clone()
        };
        let general = Picture::render(&prepared, settings);
        special.check_same_bits(&general, &format!("{what} without skipping {name}"));
        assert!(!general.stats.skipped.contains(name));
        assert!(general.stats.needs.contains(name));
    }
    special.stats.skipped
}

#[test]
fn no_skip_changes_a_bit() {
    let beauty_alone = RenderSettings {
        aovs: vec!["emission".into()],
        ..settings()
    };
    let mut glowing = stage(Vec::new());
    glowing.materials.push(black_emitter(2.0));
    let high = [[-1.0, 1.5, 0.0], [1.0, 1.5, 0.0], [0.0, 1.5, 1.0]];
    glowing.meshes.push(Mesh::polygon(&high).with_material(2));
    let shallow = RenderSettings {
        max_depth: 2,
        ..settings()
    };
    let mut skipped = BTreeSet::new();
    for (what, stage, settings) in [
        ("a lamp", stage(vec![rect_light(1.0, 1.0, 2.0)]), settings()),
        ("a dome", stage(vec![dome()]), settings()),
        ("two lights", stage(vec![dome(), parallel()]), settings()),
        ("a sun", stage(vec![parallel()]), settings()),
        ("a sun, two bounces", stage(vec![parallel()]), shallow),
        ("no light", stage(Vec::new()), settings()),
        ("a mesh that glows", glowing, settings()),
        (
            "few layers",
            stage(vec![rect_light(1.0, 1.0, 2.0)]),
            beauty_alone,
        ),
    ] {
        skipped.extend(check_skips(what, &stage, &settings));
    }
    // Nothing that can be skipped has been missed: the picture has all of it, or is without any.
    let all = stage(vec![dome()])
        .render(|s| s.specialize = false)
        .stats
        .needs;
    assert_eq!(
        skipped.into_iter().collect::<BTreeSet<_>>(),
        all.into_iter().collect()
    );
}

#[test]
fn special_walks_of_the_trees_change_no_bit() {
    for lights in [vec![rect_light(1.0, 1.0, 2.0)], vec![dome()]] {
        let stage = stage(lights);
        let render = |specialize_rays| {
            let scene = stage.scene(settings().resolution);
            let options = PrepareOptions {
                specialize_rays,
                ..PrepareOptions::default()
            };
            let prepared = PreparedScene::new(scene, &options).expect("the scene is sound");
            Picture::render(&Arc::new(prepared), settings())
        };
        let (special, general) = (render(true), render(false));
        special.check_same_bits(&general, "general walks");
        // What the special ones do without.
        assert!(special.stats.memory.accel < general.stats.memory.accel);
    }
}

#[test]
fn under_parallel_light_alone_the_last_ray_is_not_traced() {
    let render = |lights| stage(lights).render(|s| s.max_depth = 1);
    let sun = render(vec![parallel()]);
    assert!(sun.mean() > 0.1 && sun.stats.rays.shadow > 0);
    assert_eq!(sun.stats.rays.indirect, 0);
    assert!(render(vec![dome()]).stats.rays.indirect > 0);
}

#[test]
fn unknown_features_are_refused() {
    let settings = RenderSettings {
        general: vec!["wings".into()],
        ..settings()
    };
    let prepared = stage(vec![dome()]).prepare(&settings);
    match RenderJob::start(prepared, settings).map(|_| ()) {
        Err(RenderError::Setting { name, value, .. }) => {
            assert_eq!((name, value.as_str()), ("general", "wings"));
        }
        other => panic!("{other:?}"),
    }
}
