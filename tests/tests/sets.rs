//! A scene spread over a set renders as one that is whole: the same bits in every layer.

use kilauea_math::{DAffine3, DMat4, DVec3, Spectrum};
use kilauea_mesh::{CurveType, PrimvarInterpolation};
use kilauea_render::{
    Broadcast, Conditions, PhotonDemand, PlacementError, PrepareOptions, PreparedScene, SetPlan,
};
use kilauea_scene::{
    Channel, FilterKind, GlobalIllumination, Input, Integrator, Light, LightShape, Node,
    PhotonSettings, PhotonSplit, RenderSettings, Scene, Shading, Wrap,
};
use kilauea_tests::{
    Curves, Mesh, MeshPrimvar, Picture, Placements, Points, Stage, TileFile, black_emitter, glass,
    light, matte, matte_from_primvar, preview, rect_light, with_opacity,
};
use std::sync::Arc;

fn settings() -> RenderSettings {
    RenderSettings {
        resolution: [40, 24],
        samples_per_pixel: 3,
        filter: FilterKind::BlackmanHarris,
        ..Stage::settings()
    }
}

fn spread(scene: &Scene, n_members: usize) -> Arc<PreparedScene> {
    let plan = SetPlan::even(scene, n_members).expect("a set may have so many");
    let prepared = PreparedScene::spread(scene, &plan, &PrepareOptions::default());
    Arc::new(prepared.expect("the scene is sound"))
}

fn under(broadcast: Broadcast) -> Conditions {
    Conditions {
        broadcast,
        ..Conditions::default()
    }
}

/// Renders a scene whole and over sets of several sizes, in every way of asking.
fn check(name: &str, stage: &Stage, settings: &RenderSettings) {
    let whole = Picture::render(&stage.prepare(settings), settings.clone());
    assert!(whole.mean() > 1e-3, "{name} is dark: {}", whole.mean());
    let scene = stage.scene(settings.resolution);
    for n_members in [1, 2, 3, 5] {
        let prepared = spread(&scene, n_members);
        for (broadcast, shading, threads) in [
            (Broadcast::Culled, Shading::Inline, 1),
            (Broadcast::Full, Shading::Inline, 2),
            (Broadcast::Culled, Shading::Queued, 2),
            (Broadcast::Full, Shading::Queued, 1),
            (Broadcast::Culled, Shading::Bytes, 1),
            (Broadcast::Full, Shading::Bytes, 2),
        ] {
            let settings = RenderSettings {
                shading,
                threads,
                ..settings.clone()
            };
            let picture = Picture::render_under(under(broadcast), &prepared, settings);
            let what = format!("{name}, {n_members} members, {broadcast:?}, {shading:?}");
            whole.check_same_bits(&picture, &what);
        }
    }
}

/// A floor and a sphere in a box of five walls, each a mesh of its own.
fn in_a_box() -> Stage {
    let mut stage = Stage::sphere_on_floor();
    stage.lights.push(rect_light(1.0, 1.0, 2.0));
    for (x, z) in [(-1.5, 0.0), (1.5, 0.0), (0.0, -1.5)] {
        let place = DAffine3::from_translation(DVec3::new(x, 0.5, z));
        let place = place * DAffine3::from_scale(DVec3::splat(0.3));
        stage.meshes.push(Mesh::cube().placed(place));
    }
    stage
}

/// Instances of a prototype of several meshes, which move.
fn instanced() -> Stage {
    let mut stage = in_a_box();
    stage.materials.push(matte([0.2, 0.7, 0.3]));
    stage.prototypes.push("/Prototype".into());
    for (scale, x, material) in [(0.1, -0.1, 1), (0.08, 0.12, 2)] {
        let place = DAffine3::from_translation(DVec3::X * x);
        let place = place * DAffine3::from_scale(DVec3::splat(scale));
        let cube = Mesh::cube().in_prototype(1).with_material(material);
        stage.meshes.push(cube.placed(place));
    }
    let places: Vec<DAffine3> = (0..8)
        .map(|i| {
            let at = DVec3::new(0.35 * f64::from(i) - 1.2, 0.2, 0.9 - 0.1 * f64::from(i));
            DAffine3::from_translation(at) * DAffine3::from_rotation_y(0.4 * f64::from(i))
        })
        .collect();
    let later = places
        .iter()
        .map(|place| DAffine3::from_translation(0.05 * DVec3::Y) * *place);
    stage.instances.push(Placements {
        parent: 0,
        prototype: 1,
        later: vec![later.collect()],
        parent_from_prototype: places,
        primvar: None,
    });
    stage
}

/// Cut-outs, glass in glass, meshes that shine, curves and points, under a dome.
fn of_everything() -> Stage {
    let mut stage = instanced();
    stage.camera.lens_radius = 0.02;
    stage.camera.focus_distance = 3.0;
    let first = stage.materials.len() as u32;
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
    stage.spheres[0].material = first + 2;
    for (half, material) in [(0.2, 3), (0.15, 4)] {
        let place = DAffine3::from_translation(DVec3::new(0.9, 0.2, 0.9));
        let place = place * DAffine3::from_scale(DVec3::splat(half));
        let cube = Mesh::cube().placed(place);
        stage.meshes.push(cube.with_material(first + material));
    }
    let pane = Mesh::floor(0.4).placed(DAffine3::from_translation(DVec3::new(-0.4, 0.7, 0.6)));
    stage.meshes.push(pane.with_material(first));
    let strand = [[-0.9, 0.0, 0.6], [-0.8, 0.5, 0.7], [-0.9, 1.0, 0.5]];
    stage
        .curves
        .push(Curves::new(CurveType::Cubic, &strand, 0.05));
    stage.points.push(Points::new(&[[0.5, 0.2, 0.8]], 0.2));
    let triangle = [[-1.5, 0.5, -0.5], [-1.5, 0.5, 0.5], [-1.5, 1.0, 0.0]];
    stage
        .meshes
        .push(Mesh::polygon(&triangle).with_material(first + 1));
    stage.lights.push(Light {
        radiance: Spectrum::new(0.1, 0.2, 0.4),
        ..light(LightShape::Dome, DMat4::IDENTITY)
    });
    stage
}

#[test]
fn a_box_of_meshes() {
    check("box", &in_a_box(), &settings());
}

#[test]
fn instances_that_move() {
    check("instances", &instanced(), &settings());
}

/// Cubes whose color and presence are those of a picture, one of them an instance with a color of its
/// own.
fn textured(picture: &TileFile) -> Stage {
    let mut stage = in_a_box();
    stage.textures.push(picture.source());
    let mut material = with_opacity(preview(&[("diffuseColor", &[1.0; 3])]), 1.0);
    let st = material.nodes.len() as u32;
    material.nodes.push(Node::Primvar {
        name: "st".into(),
        fallback: [0.0; 4],
    });
    material.nodes.push(Node::UvTexture {
        texture: 0,
        st,
        wrap_s: Wrap::Repeat,
        wrap_t: Wrap::Repeat,
        scale: [1.0; 4],
        bias: [0.0; 4],
        fallback: [0.0; 4],
    });
    for (name, channel) in [("diffuseColor", Channel::Rgb), ("opacity", Channel::R)] {
        let node = st + 1;
        material.inputs.insert(name.into(), Input { node, channel });
    }
    let first = stage.materials.len() as u32;
    stage.materials.push(material);
    stage.materials.push(matte_from_primvar("tint"));
    let st = MeshPrimvar {
        name: "st".into(),
        interpolation: PrimvarInterpolation::FaceVarying,
        values: [0.0, 0.0, 0.0, 1.5, 0.0, 0.0, 1.5, 1.5, 0.0, 0.0, 1.5, 0.0].repeat(6),
    };
    for x in [-0.8, 0.8] {
        let place = DAffine3::from_translation(DVec3::new(x, 0.35, 0.8));
        let place = place * DAffine3::from_scale(DVec3::splat(0.3));
        let mut cube = Mesh::cube().placed(place).with_material(first);
        cube.primvars.push(st.clone());
        stage.meshes.push(cube);
    }
    stage.prototypes.push("/Tinted".into());
    let tinted = Mesh::cube().in_prototype(1).with_material(first + 1);
    let small = DAffine3::from_scale(DVec3::splat(0.12));
    stage.meshes.push(tinted.placed(small));
    let places = [[0.0, 0.15, 1.1], [0.3, 1.1, 0.2]].map(DVec3::from_array);
    stage.instances.push(Placements {
        parent: 0,
        prototype: 1,
        parent_from_prototype: places.map(DAffine3::from_translation).to_vec(),
        primvar: Some(("tint".into(), vec![0.9, 0.1, 0.1, 0.1, 0.1, 0.9])),
        later: Vec::new(),
    });
    stage
}

#[test]
fn pictures_and_primvars() {
    let checker = |x, y| {
        let is_there = (x / 8 + y / 8) % 2 == 0;
        [if is_there { 0.9 } else { 0.2 }, 0.5, x as f32 / 64.0]
    };
    let picture = TileFile::new([64, 64], checker);
    check("textured", &textured(&picture), &settings());
}

#[test]
fn every_feature() {
    check("everything", &of_everything(), &settings());
}

#[test]
fn paths_that_know_where_light_is() {
    let settings = RenderSettings {
        integrator: Integrator::Kilauea,
        general: vec!["guided_directions".into()],
        samples_per_pixel: 16,
        resolution: [24, 16],
        ..settings()
    };
    check_few("guided", &of_everything(), &settings);
}

#[test]
fn caustics_by_photons() {
    let mut stage = in_a_box();
    stage.materials.push(glass(&[]));
    stage.spheres[0].material = 2;
    let mut settings = RenderSettings {
        gi: GlobalIllumination::Consistent,
        resolution: [24, 16],
        ..settings()
    };
    settings.photons.radius = Some(0.1);
    check_few("caustics", &stage, &settings);
}

#[test]
fn photons_that_are_divided_bring_the_same_light() {
    let mut stage = in_a_box();
    stage.materials.push(glass(&[]));
    stage.spheres[0].material = 2;
    let settings = |split| {
        let mut settings = RenderSettings {
            gi: GlobalIllumination::Consistent,
            resolution: [24, 16],
            samples_per_pixel: 4,
            ..settings()
        };
        settings.photons.radius = Some(0.1);
        settings.photons.emitted_per_sample = Some(4000);
        settings.photons.split = split;
        settings
    };
    let whole = Picture::render(
        &stage.prepare(&settings(PhotonSplit::Never)),
        settings(PhotonSplit::Never),
    );
    let looked_up = |picture: &Picture| {
        let rays = picture.stats.set.as_ref().map(|set| set.rays.clone());
        let photons = rays
            .unwrap_or_default()
            .into_iter()
            .find(|r| r.kind == "photons");
        photons.map_or([0; 2], |photons| [photons.rays, photons.met])
    };
    assert!(
        whole.stats.photons.stored > 1000,
        "{:?}",
        whole.stats.photons
    );
    for n_members in [2, 3] {
        let prepared = spread(&stage.scene([24, 16]), n_members);
        for shading in [Shading::Inline, Shading::Queued, Shading::Bytes] {
            let render = |split| {
                let settings = RenderSettings {
                    shading,
                    threads: 2,
                    ..settings(split)
                };
                Picture::render(&prepared, settings)
            };
            let what = format!("{n_members} members, {shading:?}");
            let divided = render(PhotonSplit::Always);
            whole.check_same_bits(&divided, &what);
            assert_eq!(
                whole.stats.photons.stored, divided.stats.photons.stored,
                "{what}"
            );
            if shading != Shading::Inline {
                let [n_lookups, n_met] = looked_up(&divided);
                assert!(
                    n_lookups > 100 && n_met > n_lookups / 10,
                    "{what}: {n_lookups}, {n_met}"
                );
            }
            if shading == Shading::Bytes {
                let undivided = render(PhotonSplit::WhereNeeded);
                whole.check_same_bits(&undivided, &format!("{what}, not divided"));
                assert_eq!(looked_up(&undivided), [0; 2], "{what}");
            }
        }
    }
}

/// As [`check`], with a set of three alone.
fn check_few(name: &str, stage: &Stage, settings: &RenderSettings) {
    let whole = Picture::render(&stage.prepare(settings), settings.clone());
    let prepared = spread(&stage.scene(settings.resolution), 3);
    for shading in [Shading::Inline, Shading::Bytes] {
        let settings = RenderSettings {
            shading,
            ..settings.clone()
        };
        let picture = Picture::render(&prepared, settings);
        whole.check_same_bits(&picture, &format!("{name}, {shading:?}"));
        assert_eq!(whole.stats.gather, picture.stats.gather);
    }
}

/// Sixty meshes of one size.
fn many_cubes() -> Scene {
    let mut stage = Stage::sphere_on_floor();
    stage.spheres.clear();
    for i in 0..60 {
        let at = DVec3::new(f64::from(i % 8), f64::from(i / 8), -5.0);
        let place = DAffine3::from_translation(at);
        stage.meshes.push(Mesh::cube().placed(place));
    }
    stage.scene([16, 16])
}

#[test]
fn members_hold_their_part_alone() {
    let scene = many_cubes();
    let whole = scene.n_bytes() as u64;
    let bytes = spread(&scene, 3).member_bytes();
    let total: u64 = bytes.iter().map(|member| member.scene).sum();
    assert_eq!(total, whole);
    for member in bytes {
        assert!(member.scene < whole * 6 / 10, "{member:?} of {whole}");
    }
}

#[test]
fn a_set_is_as_small_as_memory_lets_it_be() {
    let scene = many_cubes();
    let all = SetPlan::even(&scene, 1).unwrap().bytes()[0];
    let n_members = |memory: &[u64]| {
        SetPlan::smallest(&scene, memory, PhotonDemand::default()).map(|p| p.n_members())
    };
    assert_eq!(n_members(&[all / 4, all, all]), Ok(1));
    let half = all * 3 / 5;
    let plan = SetPlan::smallest(&scene, &[half, half / 8, half], PhotonDemand::default()).unwrap();
    assert_eq!(plan.n_members(), 2);
    assert!(plan.bytes().iter().all(|&bytes| bytes <= half));
    assert_eq!(plan.bytes().iter().sum::<u64>(), all);

    let too_small = n_members(&[half]).unwrap_err();
    let said = too_small.to_string();
    assert!(said.contains(&all.to_string()), "{said}");
    let error = n_members(&[64, 64]).unwrap_err();
    assert!(
        matches!(&error, PlacementError::Chunk { path, largest: 64, .. } if path.starts_with('/')),
        "{error}"
    );
    assert_eq!(n_members(&[]), Err(PlacementError::Size(0)));
    assert_eq!(SetPlan::even(&scene, 65), Err(PlacementError::Size(65)));
}

#[test]
fn a_set_has_room_for_photons() {
    let scene = many_cubes();
    let all = SetPlan::even(&scene, 1).unwrap().bytes()[0];
    let n_members = |memory: u64, gi, split| {
        let settings = RenderSettings {
            gi,
            samples_per_pixel: 1,
            photons: PhotonSettings {
                // Three tenths of the scene.
                emitted_per_sample: Some((all * 3 / 10 / 32) as u32),
                split,
                ..PhotonSettings::default()
            },
            ..Stage::settings()
        };
        let photons = PhotonDemand::of(&scene, &settings);
        SetPlan::smallest(&scene, &[memory; 5], photons).map(|plan| plan.n_members())
    };
    let (exact, consistent) = (GlobalIllumination::Exact, GlobalIllumination::Consistent);
    let some = all * 6 / 10;
    assert_eq!(n_members(some, exact, PhotonSplit::Never), Ok(2));
    // Of three, each has a third of the photons of two passes; undivided, all of one.
    assert_eq!(n_members(some, consistent, PhotonSplit::WhereNeeded), Ok(3));
    assert_eq!(n_members(some, consistent, PhotonSplit::Never), Ok(4));
    assert_eq!(n_members(all, consistent, PhotonSplit::Never), Ok(1));
    let few = all * 3 / 10;
    assert_eq!(n_members(few, exact, PhotonSplit::Never), Ok(4));
    let error = n_members(few, consistent, PhotonSplit::Never).unwrap_err();
    assert!(error.to_string().contains("photons"), "{error}");
}
