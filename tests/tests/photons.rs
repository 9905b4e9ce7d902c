//! Photons in scenes where it is known what they bring.

use kilauea_math::{DAffine3, DMat4, DVec3, Spectrum, Vec3};
use kilauea_photon::{Photon, PhotonClass};
use kilauea_render::{PhotonRequest, PreparedScene, TracedPhotons, trace_photons};
use kilauea_scene::{LightShape, Material, Shading, Visibility};
use kilauea_tests::{
    Mesh, Sphere, Stage, black_emitter, check_near, facing_down, glass, light, matte, perspective,
    preview, rect_light, with_opacity,
};
use std::sync::Arc;

fn stage() -> Stage {
    Stage::new(perspective([0.0, 1.0, 4.0], [0.0, 0.0, 0.0], 0.5))
}

fn request(n_emitted: u32) -> PhotonRequest {
    PhotonRequest {
        n_emitted,
        max_depth: 64,
        seed: 0,
        n_threads: 1,
        shading: Shading::Inline,
    }
}

fn prepare(stage: &Stage) -> Arc<PreparedScene> {
    stage.prepare(&Stage::settings())
}

fn trace(stage: &Stage, n_emitted: u32) -> TracedPhotons {
    trace_photons(&prepare(stage), &request(n_emitted)).expect("nothing fails")
}

/// Keeps photons, and scatters almost none.
fn dim() -> Material {
    matte([1e-4; 3])
}

fn power<'a>(photons: impl IntoIterator<Item = &'a Photon>) -> f64 {
    let sum: f64 = photons.into_iter().map(|p| f64::from(p.power.mean())).sum();
    sum
}

/// A box of matte walls with a square lamp of a quarter under its ceiling.
fn lit_box(albedo: f32) -> Stage {
    let mut stage = stage();
    stage.materials.push(matte([albedo; 3]));
    stage.meshes.push(Mesh::cube());
    stage.lights.push(rect_light(0.5, 0.5, 0.9));
    stage
}

const PI: f64 = std::f64::consts::PI;

#[test]
fn light_in_a_closed_box_is_a_geometric_series() {
    // π L A, and all of it arrives once, a share once more, and so on.
    let flux = PI * 0.25;
    for albedo in [1e-4_f32, 0.5, 0.8] {
        let traced = trace(&lit_box(albedo), 20_000);
        let expected = flux / f64::from(1.0 - albedo);
        let found = power(&traced.photons);
        // Roulette has a standard deviation of √(ρ/N)/(1-ρ): 0.6 % for 0.5, 3 % for 0.8 of N.
        check_near(found / expected, 1.0, 0.025, &format!("albedo {albedo}"));
        assert_eq!(traced.counts.stored(), traced.photons.len() as u64);
        assert!(traced.photons.iter().all(Photon::is_valid));
    }
}

#[test]
fn photons_are_as_powerful_as_each_other() {
    let traced = trace(&lit_box(0.5), 1_000);
    let expected = PI * 0.25 / 1_000.0;
    for photon in &traced.photons {
        check_near(
            f64::from(photon.power.mean()) / expected,
            1.0,
            1e-4,
            "a photon",
        );
    }
}

#[test]
fn threads_and_ways_of_answering_do_not_change_a_photon() {
    let mut stage = lit_box(0.7);
    stage.materials.push(glass(&[("ior", &[1.4])]));
    stage.materials.push(with_opacity(matte([0.9; 3]), 0.5));
    stage.spheres.push(Sphere {
        center: [0.2, -0.4, 0.1],
        radius: 0.3,
        material: 1,
    });
    stage.meshes.push(
        Mesh::floor(0.5)
            .with_material(2)
            .placed(DAffine3::from_translation(DVec3::new(0.0, 0.3, 0.0))),
    );
    let prepared = prepare(&stage);
    let run = |n_threads, shading| {
        let request = PhotonRequest {
            n_threads,
            shading,
            max_depth: 12,
            ..request(3_000)
        };
        trace_photons(&prepared, &request).expect("nothing fails")
    };
    let reference = run(1, Shading::Inline);
    assert!(reference.counts.stored_caustic > 20 && reference.counts.stored_global > 3_000);
    for (n_threads, shading) in [
        (2, Shading::Inline),
        (7, Shading::Inline),
        (2, Shading::Queued),
        (3, Shading::Bytes),
    ] {
        let other = run(n_threads, shading);
        assert_eq!(reference.photons, other.photons, "{n_threads} {shading:?}");
        assert_eq!(reference.counts, other.counts);
    }
    let order: Vec<_> = reference
        .photons
        .iter()
        .map(|p| (p.path_idx, p.depth))
        .collect();
    assert!(order.is_sorted());
}

#[test]
fn glass_makes_caustics_and_matte_does_not() {
    let mut stage = stage();
    stage.materials = vec![dim(), glass(&[("ior", &[1.5])])];
    stage.meshes.push(Mesh::floor(2.0));
    let without = trace(&stage_with_lamp(&stage), 4_000);
    assert_eq!(without.counts.stored_caustic, 0);
    stage.spheres.push(Sphere {
        center: [0.0, 0.6, 0.0],
        radius: 0.5,
        material: 1,
    });
    let with = trace(&stage_with_lamp(&stage), 20_000);
    let (caustic, global): (Vec<_>, Vec<_>) = with
        .photons
        .iter()
        .partition(|p| matches!(p.class, PhotonClass::Caustic { .. }));
    assert_eq!(caustic.len() as u64, with.counts.stored_caustic);
    assert!(!caustic.is_empty() && !global.is_empty());
    // Straight light leaves a shadow of the sphere, radius 0.5 · 20 / (20 − 0.6), which the caustic
    // fills: a ball lens focuses at 1.5 radii from its center.
    let radius = |p: &&Photon| Vec3::new(p.p.x, 0.0, p.p.z).length();
    assert!(global.iter().map(radius).fold(f32::MAX, f32::min) > 0.5);
    let focused: Vec<&Photon> = caustic
        .iter()
        .copied()
        .filter(|p| radius(p) < 0.2)
        .collect();
    assert!(power(focused.iter().copied()) > 0.5 * power(caustic.iter().copied()));
    // No other strategy hits a lamp of this size more than seldom, and all can hit it.
    for photon in caustic {
        assert!(matches!(photon.class, PhotonClass::Caustic { d_eye } if d_eye > 0.0));
    }
}

fn stage_with_lamp(stage: &Stage) -> Stage {
    let mut stage = stage.clone();
    let disk = LightShape::Disk { radius: 0.1 };
    let mut lamp = light(disk, facing_down(0.0, 20.0, 0.0));
    lamp.shaping = Some(kilauea_scene::Shaping {
        cone_angle_degrees: 5.0,
        cone_softness: 0.0,
        focus: 0.0,
        focus_tint: Spectrum::BLACK,
    });
    stage.lights = vec![lamp];
    stage
}

/// A sun straight down on a floor: every photon arrives, and brings the same.
#[test]
fn parallel_light_covers_what_it_shines_on() {
    let mut stage = stage();
    stage.materials.push(dim());
    stage.meshes.push(Mesh::floor(2.0));
    let distant = LightShape::Distant { angle_degrees: 0.0 };
    stage
        .lights
        .push(light(distant, facing_down(0.0, 0.0, 0.0)));
    let traced = trace(&stage, 2_000);
    check_near(power(&traced.photons), 16.0, 0.03, "irradiance one on 16");
    assert!(traced.photons.len() > 1_990);
}

#[test]
fn surfaces_hidden_from_rays_are_hidden_from_photons() {
    let only = |a: Visibility, b: Visibility| a | b;
    // Lets camera and scattered rays meet it, but no light is held back; and the other way round.
    let [camera, shadow, indirect] = [Visibility::CAMERA, Visibility::SHADOW, Visibility::INDIRECT];
    let arriving = |visibility| {
        let mut stage = stage();
        stage.materials.push(dim());
        stage.meshes.push(Mesh::floor(2.0));
        let mut screen = Mesh::floor(2.0).met_by(visibility);
        screen = screen.placed(DAffine3::from_translation(DVec3::Y));
        stage.meshes.push(screen);
        let distant = LightShape::Distant { angle_degrees: 0.0 };
        stage
            .lights
            .push(light(distant, facing_down(0.0, 0.0, 0.0)));
        let traced = trace(&stage, 4_000);
        // The origin of engine space is between floor and screen.
        let (above, below): (Vec<_>, Vec<_>) = traced.photons.iter().partition(|p| p.p.y > 0.0);
        [power(above), power(below)].map(|power| power / 16.0)
    };
    for (visibility, [above, below]) in [
        (Visibility::ALL, [1.0, 0.0]),
        (only(camera, shadow), [0.0, 0.0]),
        (only(camera, indirect), [1.0, 1.0]),
        (camera, [0.0, 1.0]),
    ] {
        let found = arriving(visibility);
        check_near(found[0], above, 0.06, &format!("{visibility:?} above"));
        check_near(found[1], below, 0.06, &format!("{visibility:?} below"));
    }
}

#[test]
fn multipliers_of_a_light_count_where_it_arrives_first() {
    let mut stage = lit_box(0.5);
    stage.lights[0].diffuse = 3.0;
    let traced = trace(&stage, 20_000);
    // All that is scattered later comes from what was scattered there.
    check_near(
        power(&traced.photons) / (PI * 0.25 * 3.0 * 2.0),
        1.0,
        0.025,
        "thrice",
    );
}

#[test]
fn media_absorb_on_the_way() {
    let mut stage = stage();
    stage.materials = vec![
        dim(),
        glass(&[
            ("ior", &[1.0]),
            ("transmissionColor", &[0.5, 0.5, 0.5]),
            ("transmissionDepth", &[1.0]),
        ]),
    ];
    stage.meshes.push(Mesh::floor(1.0));
    // A slab of thickness 2.
    stage.meshes.push(
        Mesh::cube()
            .with_material(1)
            .placed(DAffine3::from_translation(DVec3::new(0.0, 2.0, 0.0))),
    );
    let distant = LightShape::Distant { angle_degrees: 0.0 };
    stage
        .lights
        .push(light(distant, facing_down(0.0, 0.0, 0.0)));
    let through = power(&trace(&stage, 1_000).photons);
    check_near(through, 4.0 * 0.25, 0.02, "a slab");
    // A lamp within the slab.
    let disk = LightShape::Disk { radius: 0.01 };
    let mut lamp = light(disk, facing_down(0.0, 2.0, 0.0));
    lamp.shaping = Some(kilauea_scene::Shaping {
        cone_angle_degrees: 1.0,
        cone_softness: 0.0,
        focus: 0.0,
        focus_tint: Spectrum::BLACK,
    });
    stage.lights = vec![lamp];
    let traced = trace(&stage, 100);
    let flux = PI * 1e-4 * PI * f64::from(1_f32.to_radians().sin()).powi(2);
    check_near(power(&traced.photons) / flux, 0.5, 0.01, "from within");
}

#[test]
fn moving_surfaces_keep_photons_where_they_are_met() {
    let mut stage = stage();
    stage.camera.shutter = [0.0, 1.0];
    stage.materials.push(dim());
    stage
        .meshes
        .push(Mesh::floor(1.0).moving(&[[0.0, 1.0, 0.0]]));
    let distant = LightShape::Distant { angle_degrees: 0.0 };
    stage
        .lights
        .push(light(distant, facing_down(0.0, 0.0, 0.0)));
    let prepared = prepare(&stage);
    let traced = trace_photons(&prepared, &request(1_000)).expect("nothing fails");
    let origin = prepared.scene.origin_world;
    let heights = traced.photons.iter().map(|p| f64::from(p.p.y) + origin.y);
    let mean = heights.sum::<f64>() / traced.photons.len() as f64;
    check_near(mean, 0.5, 0.02, "height");
}

#[test]
fn emissive_meshes_send_photons_to_both_sides() {
    let mut stage = stage();
    stage.materials = vec![dim(), black_emitter(1.0)];
    stage.meshes.push(Mesh::cube());
    stage.meshes.push(Mesh::floor(0.25).with_material(1));
    let traced = trace(&stage, 4_000);
    let (above, below): (Vec<_>, Vec<_>) = traced.photons.iter().partition(|p| p.p.y > 0.0);
    for side in [above, below] {
        check_near(power(side) / (PI * 0.25), 1.0, 0.03, "a side");
    }
}

#[test]
fn scenes_without_light_or_surfaces_have_no_photons() {
    let mut dark = stage();
    dark.materials.push(matte([0.5; 3]));
    dark.meshes.push(Mesh::floor(1.0));
    assert!(trace(&dark, 100).photons.is_empty());
    let mut empty = stage();
    empty.lights.push(rect_light(1.0, 1.0, 1.0));
    assert!(trace(&empty, 100).photons.is_empty());
    // Nothing of theirs is rough.
    let mut mirrors = lit_box(0.5);
    mirrors.materials = vec![preview(&[
        ("metallic", &[1.0]),
        ("roughness", &[0.0]),
        ("diffuseColor", &[0.5; 3]),
    ])];
    assert!(trace(&mirrors, 100).photons.is_empty());
    assert!(trace(&lit_box(0.5), 0).photons.is_empty());
}

#[test]
fn places_far_from_the_origin_get_the_same_light() {
    for (size, place) in [(1e-4, 0.0), (1e4, 0.0), (1.0, 1e5)] {
        let mut stage = lit_box(0.5);
        let transform = DAffine3::from_translation(DVec3::splat(place))
            * DAffine3::from_scale(DVec3::splat(size));
        stage.meshes[0].prototype_from_mesh = transform;
        for light in &mut stage.lights {
            light.world_from_light = DMat4::from(transform) * light.world_from_light;
        }
        let found = power(&trace(&stage, 10_000).photons) / (size * size);
        check_near(
            found / (PI * 0.25 * 2.0),
            1.0,
            0.04,
            &format!("{size} {place}"),
        );
    }
}
