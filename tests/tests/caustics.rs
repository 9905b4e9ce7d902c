//! Caustics by photons beside paths: the same light, found in other ways.

use kilauea_math::{DMat4, Spectrum};
use kilauea_render::PreparedScene;
use kilauea_scene::{
    Aim, CausticStrategy, DataWindow, FilterKind, GlobalIllumination, Light, LightShape, Material,
    PhotonSettings, Projection, RenderSettings,
};
use kilauea_testing::{Family, Moments, welch_p};
use kilauea_tests::{
    Mesh, Picture, Sphere, Stage, black_emitter, check_near, facing_down, glass, light, matte,
    perspective, preview, rect_light,
};
use std::sync::Arc;

const RADIUS: f32 = 0.05;
/// The channel that caustics on the floor are in.
const CAUSTIC: &str = "indirect_diffuse.R";

/// A ball over a floor under `lamp`, from above; most light on the floor below is a caustic.
fn ball(material: Material, lamp: Light) -> Stage {
    let mut stage = Stage::new(perspective([1.5, 2.0, 0.0], [0.0, 0.2, 0.0], 0.45));
    stage.materials = vec![matte([0.7, 0.6, 0.5]), material];
    stage.meshes.push(Mesh::floor(2.0));
    stage.spheres.push(Sphere {
        center: [0.0, 0.6, 0.0],
        radius: 0.4,
        material: 1,
    });
    stage.lights.push(lamp);
    stage
}

/// A lamp that paths find often enough to be compared with.
fn lamp() -> Light {
    bright(LightShape::Disk { radius: 0.4 }, 2.5)
}

fn bright(shape: LightShape, height: f64) -> Light {
    Light {
        radiance: Spectrum::splat(5.0),
        ..light(shape, facing_down(0.3, height, 0.2))
    }
}

fn clear() -> Material {
    glass(&[("ior", &[1.5])])
}

fn metal(roughness: f32) -> Material {
    preview(&[
        ("diffuseColor", &[0.9, 0.8, 0.7]),
        ("metallic", &[1.0]),
        ("roughness", &[roughness]),
    ])
}

fn settings() -> RenderSettings {
    RenderSettings {
        samples_per_pixel: 32,
        max_depth: 6,
        aovs: vec!["Z".into()],
        ..Stage::settings()
    }
}

fn consistent(found_by: CausticStrategy, radius: f32) -> RenderSettings {
    found_by_some(GlobalIllumination::Consistent, found_by, radius)
}

/// With photons that the camera sees itself in place of merging, if `gi` is exact.
fn found_by_some(gi: GlobalIllumination, found_by: CausticStrategy, radius: f32) -> RenderSettings {
    RenderSettings {
        gi,
        photons: PhotonSettings {
            emitted_per_sample: Some(1000),
            radius: Some(radius),
            found_by,
            ..PhotonSettings::default()
        },
        ..settings()
    }
}

/// Without photons.
fn by_paths() -> RenderSettings {
    let (gi, found_by) = (GlobalIllumination::Exact, CausticStrategy::Paths);
    found_by_some(gi, found_by, RADIUS)
}

/// Other random numbers for each way to find caustics.
fn seed_base(settings: &RenderSettings) -> u32 {
    1000 * settings.photons.found_by as u32 + 10_000 * settings.gi as u32
}

/// All ways to find caustics by photons, by paths and by both.
const STRATEGIES: [(GlobalIllumination, CausticStrategy); 5] = [
    (GlobalIllumination::Consistent, CausticStrategy::All),
    (GlobalIllumination::Consistent, CausticStrategy::Photons),
    (GlobalIllumination::Consistent, CausticStrategy::Paths),
    (GlobalIllumination::Exact, CausticStrategy::All),
    (GlobalIllumination::Exact, CausticStrategy::Photons),
];

/// Means of the whole picture, over seeds. Merging moves light by a radius at most, so that next to
/// nothing of it leaves the picture.
fn means(prepared: &Arc<PreparedScene>, settings: &RenderSettings, n_seeds: u32) -> Moments {
    let first = seed_base(settings);
    let mean = |seed| {
        let settings = RenderSettings {
            seed: first + seed,
            ..settings.clone()
        };
        Picture::render(prepared, settings).mean()
    };
    Moments::of(&(1..=n_seeds).map(mean).collect::<Vec<_>>())
}

/// Each strategy alone finds the whole light of caustics, and so do all of them together: what none
/// counts is counted by another, and nothing twice.
#[test]
fn all_strategies_find_the_same_light() {
    let sun = |angle_degrees| Light {
        radiance: Spectrum::splat(if angle_degrees > 0.0 { 100.0 } else { 1.0 }),
        ..light(
            LightShape::Distant { angle_degrees },
            facing_down(0.0, 0.0, 0.0),
        )
    };
    let mut family = Family::new("strategies");
    let mut check = |name: &str, stage: &Stage| {
        let prepared = stage.prepare(&settings());
        let by_paths = means(&prepared, &by_paths(), 12);
        for (gi, found_by) in STRATEGIES {
            let found = means(&prepared, &found_by_some(gi, found_by, RADIUS), 12);
            // Edges of the ball and of the floor lose a little of what is merged there.
            let p = welch_p(&by_paths, &found, 3e-3 * by_paths.mean);
            family.add(format!("{name}, {gi:?} by {found_by:?}"), p);
        }
    };
    check("glass", &ball(clear(), lamp()));
    check("a mirror", &ball(metal(0.0), lamp()));
    check("nearly a mirror", &ball(metal(0.045), lamp()));
    check("a low sun", &ball(clear(), sun(10.0)));
    check(
        "a point of a sun, nearly a mirror",
        &ball(metal(0.045), sun(0.0)),
    );
    let coated = preview(&[("diffuseColor", &[0.2; 3]), ("clearcoat", &[1.0])]);
    check("a coat in a low sun", &ball(coated, sun(10.0)));
    check(
        "a dome",
        &ball(clear(), light(LightShape::Dome, DMat4::IDENTITY)),
    );
    let sphere = bright(LightShape::Sphere { radius: 0.3 }, 1.8);
    check("a sphere that shines", &ball(clear(), sphere));

    let mut shining_mesh = ball(clear(), lamp());
    shining_mesh.lights.clear();
    shining_mesh.materials.push(black_emitter(5.0));
    let quad = [
        [-0.3, 2.0, 0.3],
        [-0.3, 2.0, -0.3],
        [0.3, 2.0, -0.3],
        [0.3, 2.0, 0.3],
    ];
    shining_mesh
        .meshes
        .push(Mesh::polygon(&quad).with_material(2));
    check("a mesh that shines", &shining_mesh);

    let mut glossy_floor = ball(clear(), lamp());
    glossy_floor.materials[0] = preview(&[("diffuseColor", &[0.3; 3]), ("roughness", &[0.2])]);
    check("a glossy floor", &glossy_floor);

    let mut in_a_mirror = ball(clear(), lamp());
    in_a_mirror.camera = perspective([0.0, 0.3, 1.8], [0.0, 0.3, 3.0], 0.8);
    in_a_mirror.materials.push(metal(0.0));
    let wall = [
        [-2.0, 0.0, 2.5],
        [-2.0, 2.0, 2.5],
        [2.0, 2.0, 2.5],
        [2.0, 0.0, 2.5],
    ];
    in_a_mirror
        .meshes
        .push(Mesh::polygon(&wall).with_material(2));
    check("seen in a mirror", &in_a_mirror);

    let mut inside = ball(clear(), lamp());
    inside.camera = perspective([0.0, 0.7, 0.0], [0.1, 0.0, 0.1], 0.6);
    check("seen from within the glass", &inside);
    family.check();
}

/// A floor beside a wall that shows it a large sun.
fn beside_wall_in_the_sun(wall: Material) -> Stage {
    let sun = LightShape::Distant {
        angle_degrees: 30.0,
    };
    let aslant = DMat4::from_rotation_z(-0.8) * facing_down(0.0, 0.0, 0.0);
    let mut stage = Stage::sphere_beside_wall();
    stage.spheres.clear();
    stage.materials[2] = wall;
    stage.camera = perspective([1.5, 2.0, 0.0], [0.0, 0.0, 0.0], 0.45);
    stage.lights.push(light(sun, aslant));
    stage
}

/// Whether photons, paths and both together find the same light in a layer, with so few photons that each
/// of them has a share.
fn finds_once(name: &str, stage: &Stage, layer: &str) {
    let channel = format!("{layer}.R");
    let found = |settings: &RenderSettings| {
        let settings = RenderSettings {
            aovs: vec![layer.into()],
            ..settings.clone()
        };
        let prepared = stage.prepare(&settings);
        let mean = |seed| {
            let settings = RenderSettings {
                seed: seed_base(&settings) + seed,
                ..settings.clone()
            };
            Picture::render(&prepared, settings).mean_of(&channel)
        };
        Moments::of(&(1..=96).map(mean).collect::<Vec<_>>())
    };
    let by_paths = found(&by_paths());
    let mut family = Family::new(name);
    for (gi, found_by) in STRATEGIES {
        let mut few = found_by_some(gi, found_by, RADIUS);
        few.photons.emitted_per_sample = Some(100);
        let found = found(&few);
        let p = welch_p(&by_paths, &found, 3e-3 * by_paths.mean);
        family.add(
            format!("{gi:?} by {found_by:?}: {found:?}, {by_paths:?}"),
            p,
        );
    }
    family.check();
}

/// A ray that is aimed by a coat, the path that draws it and photons share the light of a spot, which is most
/// of what the wall brings.
#[test]
fn what_a_coat_shows_of_the_sun_is_found_once() {
    let coated = preview(&[("diffuseColor", &[0.02; 3]), ("clearcoat", &[1.0])]);
    let stage = beside_wall_in_the_sun(coated);
    finds_once("a coat in the sun", &stage, "indirect_diffuse");
}

/// A surface with a narrow lobe over a rough one: which of them scattered is told apart, as some directions belong
/// to both.
fn varnished() -> Material {
    preview(&[
        ("diffuseColor", &[0.3; 3]),
        ("roughness", &[0.4]),
        ("clearcoat", &[1.0]),
        ("clearcoatRoughness", &[0.12]),
    ])
}

#[test]
fn what_narrow_lobes_show_of_the_sun_is_found_once() {
    let plastic = preview(&[("diffuseColor", &[0.05; 3]), ("roughness", &[0.1])]);
    let stage = beside_wall_in_the_sun(plastic);
    finds_once("plastic in the sun", &stage, "indirect_diffuse");
    let stage = beside_wall_in_the_sun(varnished());
    finds_once("varnish in the sun", &stage, "indirect_diffuse");
}

/// The camera sees the sun in a mirror by the floor's narrow lobe, and the light of the mirror on the floor's
/// rough ones.
#[test]
fn what_narrow_lobes_show_of_a_mirror_is_found_once() {
    let mut stage = beside_wall_in_the_sun(metal(0.0));
    stage.materials[0] = varnished();
    finds_once("a mirror over varnish", &stage, "indirect_specular");
}

/// A ball beside a caustic on the floor: a path meets what throws it from its second rough vertex.
#[test]
fn caustics_that_light_other_surfaces_are_found_once() {
    let mut stage = beside_wall_in_the_sun(metal(0.0));
    stage.materials[1] = matte([0.8; 3]);
    stage.spheres.push(Sphere {
        center: [0.0, 0.5, 0.0],
        radius: 0.5,
        material: 1,
    });
    stage.camera = perspective([0.0, 0.5, 2.0], [0.0, 0.3, 0.0], 0.2);
    finds_once("a ball beside a caustic", &stage, "indirect_diffuse");
}

/// Mean squared difference to a picture of the caustic on the floor, over seeds: that of the means
/// of the pixels, without what their variance adds.
fn squared_bias(stage: &Stage, radius: f32) -> f64 {
    const N_SEEDS: u32 = 24;
    let settings = RenderSettings {
        samples_per_pixel: 16,
        ..settings()
    };
    let prepared = stage.prepare(&settings);
    let pixels = |radius: f32| -> Vec<Moments> {
        let pictures: Vec<Picture> = (0..N_SEEDS)
            .map(|seed| {
                let photons = consistent(CausticStrategy::Photons, radius).photons;
                let settings = RenderSettings {
                    seed: seed + (1e3 * radius) as u32,
                    photons: PhotonSettings {
                        emitted_per_sample: Some(4000),
                        ..photons
                    },
                    gi: GlobalIllumination::Consistent,
                    // Alone, as the lamp is seen through the ball: much noise, which is not photons'.
                    aovs: vec!["indirect_diffuse".into()],
                    ..settings.clone()
                };
                Picture::render(&prepared, settings)
            })
            .collect();
        let n_pixels = pictures[0].channel(CAUSTIC).len();
        let of_pixel = |idx| {
            let values: Vec<f64> = pictures
                .iter()
                .map(|p| f64::from(p.channel(CAUSTIC)[idx]))
                .collect();
            Moments::of(&values)
        };
        (0..n_pixels).map(of_pixel).collect()
    };
    let (sharp, blurred) = (pixels(0.05), pixels(radius));
    let unbiased = |(a, b): (&Moments, &Moments)| {
        (a.mean - b.mean).powi(2) - a.variance / a.n - b.variance / b.n
    };
    sharp.iter().zip(&blurred).map(unbiased).sum::<f64>() / sharp.len() as f64
}

/// Bias grows as the square of the radius, where that is small beside what there is to see.
#[test]
fn bias_vanishes_with_the_radius() {
    let mut lamp = bright(LightShape::Disk { radius: 0.1 }, 2.5);
    lamp.radiance *= 10.0;
    let stage = ball(clear(), lamp);
    let [wide, narrow] = [0.4, 0.2].map(|radius| squared_bias(&stage, radius));
    assert!(
        wide > 0.0 && narrow < 0.25 * wide,
        "{wide:.3e} {narrow:.3e}"
    );
}

#[test]
fn radii_shrink_from_pass_to_pass() {
    let stage = ball(clear(), lamp());
    let photons = stage
        .render(|s| *s = consistent(CausticStrategy::All, RADIUS))
        .stats
        .photons;
    assert_eq!(photons.first_radius, RADIUS);
    // r² falls with the power -1/3 of the number of samples; the last pass begins with sample 17.
    let expected = RADIUS * 17_f32.powf(-1.0 / 6.0);
    assert!(
        (photons.last_radius / expected - 1.0).abs() < 0.1,
        "{photons:?}"
    );
    assert!(
        photons.emitted == 32 * 1000 && photons.stored > 500,
        "{photons:?}"
    );
}

/// With a radius chosen by what a few photons say, and for the same samples, the error is much less
/// where the caustic is, which paths hardly ever find; all else is in the same layers.
#[test]
fn photons_are_used_where_they_pay() {
    let mut lamp = bright(LightShape::Disk { radius: 0.05 }, 2.5);
    lamp.radiance *= 50.0;
    let mut stage = ball(clear(), lamp);
    // Below the ball, where its light gathers.
    stage.camera = perspective([1.5, 0.5, 0.0], [0.0, 0.0, 0.0], 0.45);
    let prepared = stage.prepare(&settings());
    let render = |gi, emitted, radius| {
        let settings = RenderSettings {
            gi,
            samples_per_pixel: 16,
            resolution: [64, 64],
            aovs: Vec::new(),
            photons: PhotonSettings {
                emitted_per_sample: Some(emitted),
                radius,
                // `exact` would find most of it too.
                aim: Aim::Never,
                ..PhotonSettings::default()
            },
            ..settings()
        };
        Picture::render(&prepared, settings)
    };
    let exact = render(GlobalIllumination::Exact, 0, None);
    let seen = render(GlobalIllumination::Exact, 4000, None);
    let consistent = render(GlobalIllumination::Consistent, 4000, None);
    let reference = render(GlobalIllumination::Consistent, 40_000, Some(0.05));
    let error = |picture: &Picture| {
        let pairs = picture
            .channel(CAUSTIC)
            .iter()
            .zip(reference.channel(CAUSTIC));
        pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>()
    };
    let error_exact = error(&exact);
    for picture in [&consistent, &seen] {
        let error = error(picture);
        assert!(error < 0.2 * error_exact, "{error:.3e} {error_exact:.3e}");
        let stats = &picture.stats;
        assert!(stats.photons.skipped.is_empty(), "{:?}", stats.photons);
        assert!(stats.photons.stored > 1000 && stats.rays.photon > stats.photons.stored);
        assert!(stats.memory.photons > 0 && stats.times.photon > 0.0);
        for layer in ["direct_diffuse.R", "direct_specular.R", "emission.R"] {
            let (a, b) = (picture.channel(layer), exact.channel(layer));
            assert_eq!(a, b, "{layer}");
        }
    }
}

/// A sky, which paths find behind glass as well as photons do.
#[test]
fn photons_are_not_used_where_they_take_little_noise() {
    let sky = light(LightShape::Dome, DMat4::IDENTITY);
    let stage = ball(clear(), sky);
    for gi in [GlobalIllumination::Consistent, GlobalIllumination::Exact] {
        let picture = stage.render(|s| {
            *s = settings();
            s.gi = gi;
            s.photons.emitted_per_sample = Some(1000);
        });
        let skipped = picture.stats.photons.skipped.join(" ");
        assert!(
            skipped.contains("too little of the noise"),
            "{gi:?}: {skipped}"
        );
    }
}

/// No light comes over specular surfaces.
#[test]
fn without_caustics_no_bit_changes() {
    let mut stage = Stage::sphere_on_floor();
    stage.lights.push(rect_light(1.0, 1.0, 2.0));
    let prepared = stage.prepare(&settings());
    let render = |gi| Picture::render(&prepared, RenderSettings { gi, ..settings() });
    let consistent = render(GlobalIllumination::Consistent);
    let exact = render(GlobalIllumination::Exact);
    exact.check_same_bits(&consistent, "no caustics");
    Picture::render(&prepared, by_paths()).check_same_bits(&exact, "paths alone");
    for picture in [consistent, exact] {
        let photons = &picture.stats.photons;
        let skipped = &photons.skipped;
        assert!(
            skipped.len() == 1 && skipped[0].contains("caustic photons"),
            "{skipped:?}"
        );
        assert_eq!(photons.emitted, 0);
    }
}

#[test]
fn threads_and_ways_of_answering_do_not_change_a_bit() {
    // So small that it pays to look at photons.
    let mut lamp = bright(LightShape::Disk { radius: 0.05 }, 2.5);
    lamp.radiance *= 50.0;
    let stage = ball(clear(), lamp);
    for gi in [GlobalIllumination::Consistent, GlobalIllumination::Exact] {
        let settings = RenderSettings {
            resolution: [40, 36],
            samples_per_pixel: 6,
            gi,
            photons: PhotonSettings {
                emitted_per_sample: Some(1000),
                ..PhotonSettings::default()
            },
            ..settings()
        };
        let picture = Picture::check_ways_of_rendering(&stage.prepare(&settings), &settings);
        let photons = &picture.stats.photons;
        assert!(photons.stored > 100, "{gi:?}: {photons:?}");
    }
}

#[test]
fn any_scene_has_its_picture_or_a_reason() {
    any_scene_has_its_picture(GlobalIllumination::Consistent);
    any_scene_has_its_picture(GlobalIllumination::Exact);
}

fn any_scene_has_its_picture(gi: GlobalIllumination) {
    let with = |stage: &Stage, emitted| {
        stage.render(|s| {
            *s = found_by_some(gi, CausticStrategy::All, RADIUS);
            s.photons.emitted_per_sample = Some(emitted);
        })
    };
    let glass_ball = ball(clear(), lamp());
    for emitted in [0, 1] {
        let picture = with(&glass_ball, emitted);
        picture.check_finite(&format!("{emitted} photons"));
        let exact = glass_ball.render(|s| *s = by_paths());
        // What paths find is whole where photons find nothing, up to noise.
        check_near(picture.mean(), exact.mean(), 0.3, "few photons");
    }
    let reason = |stage: &Stage| {
        let picture = stage.render(|s| {
            s.gi = gi;
            s.samples_per_pixel = 4;
            s.photons.emitted_per_sample = Some(2000);
        });
        picture.check_finite("a picture");
        picture.stats.photons.skipped.join(" ")
    };
    let mut dark = glass_ball.clone();
    dark.lights.clear();
    assert!(reason(&dark).contains("no light sends any out"));
    let mut all_specular = glass_ball.clone();
    all_specular.materials[0] = metal(0.0);
    assert!(reason(&all_specular).contains("too few arrive where they are seen"));
    let mut empty = glass_ball.clone();
    (empty.meshes, empty.spheres) = (Vec::new(), Vec::new());
    assert!(reason(&empty).contains("no light sends any out"));
    let mut moving = glass_ball.clone();
    moving.camera.shutter = [0.0, 1.0];
    moving.meshes[0] = Mesh::floor(2.0).moving(&[[0.0, 0.1, 0.0]]);
    assert!(reason(&moving).contains("moves"));
    let short = glass_ball.render(|s| {
        s.gi = gi;
        s.max_depth = 1;
    });
    assert!(short.stats.photons.skipped[0].contains("too short"));
}

/// The camera sees photons where its own rays arrive, and as bright, however it looks.
#[test]
fn any_camera_sees_photons() {
    let mut family = Family::new("cameras");
    let gi = GlobalIllumination::Exact;
    let mut check = |name: &str, change: fn(&mut Stage), settings: fn(&mut RenderSettings)| {
        let mut stage = ball(clear(), lamp());
        change(&mut stage);
        let [paths, photons] = [CausticStrategy::Paths, CausticStrategy::Photons].map(|found_by| {
            let mut all = found_by_some(gi, found_by, RADIUS);
            settings(&mut all);
            means(&stage.prepare(&all), &all, 12)
        });
        family.add(
            name.to_owned(),
            welch_p(&paths, &photons, 1e-3 * paths.mean),
        );
    };
    check(
        "a lens",
        |stage| (stage.camera.lens_radius, stage.camera.focus_distance) = (0.3, 1.5),
        |_| (),
    );
    check("no perspective", seen_in_parallel, |_| ());
    check(
        "no perspective, a lens",
        |stage| {
            seen_in_parallel(stage);
            (stage.camera.lens_radius, stage.camera.focus_distance) = (0.3, 1.5);
        },
        |_| (),
    );
    check(
        "a wide filter",
        |_| (),
        |s| (s.filter, s.filter_radius) = (FilterKind::Gaussian, Some(3.0)),
    );
    check(
        "exposure",
        |stage| stage.camera.exposure_scale = 2.5,
        |_| (),
    );
    family.check();
}

fn seen_in_parallel(stage: &mut Stage) {
    stage.camera.projection = Projection::Orthographic;
    stage.camera.screen_window = [-0.9, -0.9, 0.9, 0.9];
}

/// A part of a picture has the photons that it has in the whole.
#[test]
fn a_part_of_a_picture_sees_the_same_photons() {
    let mut settings = found_by_some(GlobalIllumination::Exact, CausticStrategy::All, RADIUS);
    settings.resolution = [40, 36];
    settings.samples_per_pixel = 3;
    settings.aovs = vec!["indirect_diffuse".into()];
    let prepared = ball(clear(), lamp()).prepare(&settings);
    let whole = Picture::render(&prepared, settings.clone());
    let (min, max) = ([10, 12], [33, 30]);
    settings.data_window = Some(DataWindow { min, max });
    let part = Picture::render(&prepared, settings);
    let (of_whole, of_part) = (whole.channel(CAUSTIC), part.channel(CAUSTIC));
    let mut of_part = of_part.iter();
    for y in min[1]..max[1] {
        for x in min[0]..max[0] {
            assert_eq!(Some(&of_whole[(y * 40 + x) as usize]), of_part.next());
        }
    }
}

/// With so many photons that they and paths have about the same share of what a wall throws on the floor, and alone.
#[test]
fn seen_photons_and_paths_share_all_light() {
    let mut family = Family::new("shares");
    let mut check = |name: &str, wall: Material| {
        let stage = beside_wall_in_the_sun(wall);
        let gi = GlobalIllumination::Exact;
        let found = |found_by, emitted| {
            let mut settings = found_by_some(gi, found_by, RADIUS);
            settings.aovs = vec!["indirect_diffuse".into()];
            settings.photons.emitted_per_sample = Some(emitted);
            let prepared = stage.prepare(&settings);
            let mean = |seed| {
                let settings = RenderSettings {
                    seed: seed_base(&settings) + seed,
                    ..settings.clone()
                };
                Picture::render(&prepared, settings).mean_of(CAUSTIC)
            };
            Moments::of(&(1..=48).map(mean).collect::<Vec<_>>())
        };
        let paths = found(CausticStrategy::Paths, 0);
        for (found_by, emitted) in [
            (CausticStrategy::All, 200),
            (CausticStrategy::Photons, 4000),
        ] {
            let found = found(found_by, emitted);
            let p = welch_p(&paths, &found, 1e-3 * paths.mean);
            family.add(format!("{name}, {emitted} by {found_by:?}"), p);
        }
    };
    check("a mirror", metal(0.0));
    check("metal", metal(0.12));
    family.check();
}
