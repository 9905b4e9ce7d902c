//! Paths that end with irradiance from photons: the light of `exact`, with a bias that vanishes.

use std::sync::Arc;

use kilauea_math::{DAffine3, DMat4, DVec3, Spectrum};
use kilauea_render::PreparedScene;
use kilauea_scene::{
    Aim, FinalGathering, GlobalIllumination, Light, LightShape, PhotonSettings, RenderSettings,
};
use kilauea_testing::{Family, Moments, welch_p};
use kilauea_tests::{
    Mesh, Picture, Points, Stage, black_emitter, check_near, facing_down, glass, light, matte,
    perspective, preview, rect_light,
};

/// What photons may lose next to edges, of all light.
const BIAS: f64 = 0.012;

/// Looks up with `emitted` paths of light for each sample of the pixels, whether it pays or not.
fn gathering(emitted: u32) -> RenderSettings {
    RenderSettings {
        gi: GlobalIllumination::Consistent,
        photons: PhotonSettings {
            emitted_per_sample: Some(emitted),
            final_gathering: FinalGathering::Always,
            ..PhotonSettings::default()
        },
        aovs: vec!["Z".into()],
        samples_per_pixel: 32,
        max_depth: 6,
        ..Stage::settings()
    }
}

fn exact() -> RenderSettings {
    RenderSettings {
        gi: GlobalIllumination::Exact,
        photons: PhotonSettings::default(),
        ..gathering(0)
    }
}

/// Light after n bounces in a box of albedo one half is 1 - 2^-(n + 1). Were direct light at the second
/// vertex counted twice, or light that is scattered once too often, it would be 1.125 in place of
/// 0.875 after two, and 0.9375.
#[test]
fn a_closed_box_has_its_known_light_at_any_depth() {
    let stage = Stage::box_of_light(matte([0.5; 3]));
    for (depth, expected) in [(2, 0.875), (3, 0.9375), (16, 1.0)] {
        let picture = stage.render(|s| {
            *s = RenderSettings {
                max_depth: depth,
                samples_per_pixel: 256,
                ..gathering(500)
            }
        });
        assert!(picture.stats.final_gather.records > 10_000);
        check_near(picture.mean(), expected, BIAS, &format!("depth {depth}"));
    }
}

/// Only next to edges do photons miss some light, and as far as they reach.
#[test]
fn bias_vanishes_with_the_number_of_photons() {
    let stage = Stage::box_of_light(matte([0.5; 3]));
    let mean = |settings: RenderSettings| {
        let picture = stage.render(|s| {
            *s = RenderSettings {
                max_depth: 16,
                samples_per_pixel: 256,
                ..settings
            }
        });
        picture.mean()
    };
    // Of the same samples, as far as both take them alike.
    let expected = mean(exact());
    let lost = |emitted| expected - mean(gathering(emitted));
    // Sixteen times the photons reach a quarter as far.
    let [few, many] = [32, 512].map(lost);
    assert!(few > 0.01 && many.abs() < 0.5 * few, "{few:.4} {many:.4}");
}

/// A glossy ball beside a wall and on a floor.
fn room(lamp: Light) -> Stage {
    let mut stage = Stage::sphere_beside_wall();
    stage.lights.push(lamp);
    stage
}

fn means(prepared: &Arc<PreparedScene>, settings: &RenderSettings, first_seed: u32) -> Moments {
    const N_SEEDS: u32 = 8;
    let mean = |seed| {
        let settings = RenderSettings {
            seed,
            ..settings.clone()
        };
        Picture::render(prepared, settings).mean()
    };
    Moments::of(
        &(first_seed..first_seed + N_SEEDS)
            .map(mean)
            .collect::<Vec<_>>(),
    )
}

/// What looks up, what still goes on by other lobes and what photons share at the first vertex add up to
/// the light of `exact`.
#[test]
fn the_light_is_that_of_exact() {
    let mut family = Family::new("final gathering");
    let mut check = |name: &str, stage: &Stage, change: fn(&mut RenderSettings)| {
        let mut settings = gathering(1000);
        change(&mut settings);
        let prepared = stage.prepare(&settings);
        let exact = RenderSettings {
            gi: GlobalIllumination::Exact,
            ..settings.clone()
        };
        let expected = means(&prepared, &exact, 0);
        let found = means(&prepared, &settings, 100);
        let stats = Picture::render(&prepared, settings).stats;
        assert!(stats.final_gather.records > 1000, "{name}");
        family.add(name, welch_p(&expected, &found, BIAS * expected.mean));
    };
    let rect = rect_light(1.0, 1.0, 2.0);
    check("plastic under a lamp", &room(rect.clone()), |_| {});
    check("aimed at a skylight", &room_with_a_skylight(), |s| {
        s.photons.emitted_per_sample = Some(16_000);
    });
    let dome = light(LightShape::Dome, DMat4::IDENTITY);
    check("under a dome", &room(dome), |_| {});
    let sun = light(
        LightShape::Distant { angle_degrees: 1.0 },
        facing_down(0.0, 0.0, 0.0),
    );
    check(
        "under a sun",
        &room(Light {
            radiance: Spectrum::splat(1e4),
            ..sun
        }),
        |_| {},
    );

    let mut shining_mesh = room(rect.clone());
    shining_mesh.lights.clear();
    shining_mesh.materials.push(black_emitter(5.0));
    let quad = [
        [-0.5, 2.0, 0.5],
        [-0.5, 2.0, -0.5],
        [0.5, 2.0, -0.5],
        [0.5, 2.0, 0.5],
    ];
    let quad = Mesh::polygon(&quad).with_material(3);
    shining_mesh.meshes.push(quad);
    check("under a mesh that shines", &shining_mesh, |_| {});

    let mut all_plastic = room(rect.clone());
    let plastic = preview(&[
        ("diffuseColor", &[0.5, 0.6, 0.4]),
        ("roughness", &[0.2]),
        ("clearcoat", &[1.0]),
    ]);
    all_plastic.materials.fill(plastic);
    check("plastic under a smooth coat", &all_plastic, |_| {});

    let mut varnished = room(rect.clone());
    varnished.materials.fill(preview(&[
        ("diffuseColor", &[0.5, 0.6, 0.4]),
        ("roughness", &[0.4]),
        ("clearcoat", &[1.0]),
        ("clearcoatRoughness", &[0.12]),
    ]));
    check("varnish, and photons of what it shows", &varnished, |s| {
        s.photons.radius = Some(0.05);
        s.photons.aim = Aim::Never;
    });

    let mut in_a_mirror = room(rect.clone());
    in_a_mirror.materials[1] = preview(&[("metallic", &[1.0]), ("roughness", &[0.0])]);
    check("a mirror", &in_a_mirror, |_| {});

    let mut caustic = room(rect);
    caustic.materials[1] = glass(&[("ior", &[1.5])]);
    check("glass, and photons of its caustics", &caustic, |s| {
        s.photons.radius = Some(0.05);
        // `exact` finds the same light at other places of its paths.
        s.photons.aim = Aim::Never;
    });
    family.check();
}

/// A room with a hole in its ceiling under a wide sky, on wide ground.
fn room_with_a_skylight() -> Stage {
    const HALF: f32 = 2.0;
    const HOLE: f32 = 1.0;
    let mut stage = Stage::new(perspective([0.0, 0.0, 1.9], [0.0, -0.5, -2.0], 1.0));
    stage.materials = vec![matte([0.7, 0.6, 0.5])];
    let walls = DAffine3::from_scale(DVec3::splat(HALF.into()));
    for face in [0, 1, 2, 4, 5] {
        stage.meshes.push(Mesh::cube_face(face).placed(walls));
    }
    for quarter in 0..4 {
        let strip = [
            [-HALF, HALF, HALF],
            [HALF, HALF, HALF],
            [HOLE, HALF, HOLE],
            [-HOLE, HALF, HOLE],
        ];
        let turned = DAffine3::from_rotation_y(f64::from(quarter) * std::f64::consts::FRAC_PI_2);
        stage.meshes.push(Mesh::polygon(&strip).placed(turned));
    }
    let below = DAffine3::from_translation(DVec3::new(0.0, -2.5, 0.0));
    stage.meshes.push(Mesh::floor(6.0).placed(below));
    stage.lights.push(light(LightShape::Dome, DMat4::IDENTITY));
    stage
}

/// Of the sky's light one part in a hundred comes into the room, where it is scattered more often than
/// on the ground. That is where photons are sent: else paths would leave 0.63 each.
#[test]
fn photons_are_sent_where_they_are_looked_up() {
    let gathered = |stage: &Stage| {
        let picture = stage.render(|s| *s = gathering(2000));
        picture.stats.final_gather
    };
    let found = gathered(&room_with_a_skylight());
    assert!(found.seen < 0.1, "{found:?}");
    let kept_per_path = found.photons as f64 / found.emitted as f64;
    assert!(kept_per_path > 0.8, "{found:?}");
    // Where all of it is looked up light goes as it goes.
    let inside = gathered(&Stage::box_of_light(matte([0.5; 3])));
    assert!(inside.seen > 0.5, "{inside:?}");
}

/// A lamp before a wall, which is seen lit by the wall alone: paths have to find what light comes by.
fn indirectly_lit() -> Stage {
    let mut stage = Stage::new(perspective([0.0, 1.0, 3.5], [0.0, 1.0, 0.0], 0.6));
    stage.materials = vec![matte([0.7, 0.6, 0.5])];
    stage
        .meshes
        .push(Mesh::cube().placed(DAffine3::from_scale(DVec3::splat(4.0))));
    let lamp = Light {
        radiance: Spectrum::splat(50.0),
        ..light(
            LightShape::Disk { radius: 0.1 },
            facing_down(0.0, -3.5, 3.0),
        )
    };
    stage.lights.push(lamp);
    stage
}

fn where_it_pays() -> RenderSettings {
    RenderSettings {
        gi: GlobalIllumination::Consistent,
        resolution: [64, 64],
        samples_per_pixel: 32,
        ..exact()
    }
}

#[test]
fn it_is_used_where_a_trial_says_that_it_pays() {
    let stage = indirectly_lit();
    let prepared = stage.prepare(&where_it_pays());
    let picture = Picture::render(&prepared, where_it_pays());
    let found = &picture.stats.final_gather;
    assert!(found.gain > 1.2 && found.skipped.is_empty(), "{found:?}");
    assert!(found.photons > 1000 && found.records > 250, "{found:?}");
    let exact = RenderSettings {
        gi: GlobalIllumination::Exact,
        ..where_it_pays()
    };
    let plain = Picture::render(&prepared, exact);
    let rays = |picture: &Picture| picture.stats.rays.indirect + picture.stats.rays.shadow;
    assert!(
        rays(&picture) < rays(&plain),
        "{} {}",
        rays(&picture),
        rays(&plain)
    );
}

/// Under an open sky all light is direct: there is nothing to look up.
#[test]
fn where_it_does_not_pay_no_bit_changes() {
    let mut stage = Stage::new(perspective([0.0, 1.2, 3.0], [0.0, 0.4, 0.0], 0.5));
    stage.materials = vec![matte([0.7, 0.6, 0.5])];
    stage.meshes.push(Mesh::floor(2.0));
    stage.lights.push(light(LightShape::Dome, DMat4::IDENTITY));
    let prepared = stage.prepare(&where_it_pays());
    let render = |gi| {
        let settings = RenderSettings {
            gi,
            ..where_it_pays()
        };
        Picture::render(&prepared, settings)
    };
    let consistent = render(GlobalIllumination::Consistent);
    render(GlobalIllumination::Exact).check_same_bits(&consistent, "it does not pay");
    let found = &consistent.stats.final_gather;
    assert!(found.skipped[0].contains("times as efficient"), "{found:?}");
}

#[test]
fn threads_and_ways_of_answering_do_not_change_a_bit() {
    let mut stage = room(rect_light(1.0, 1.0, 2.0));
    stage.materials[1] = glass(&[("ior", &[1.5])]);
    let settings = RenderSettings {
        resolution: [40, 36],
        samples_per_pixel: 6,
        ..gathering(2000)
    };
    for radius in [None, Some(0.05)] {
        let mut settings = settings.clone();
        settings.photons.radius = radius;
        let picture = Picture::check_ways_of_rendering(&stage.prepare(&settings), &settings);
        assert!(picture.stats.final_gather.records > 100);
    }
}

#[test]
fn any_scene_has_its_picture_or_a_reason() {
    let reason = |stage: &Stage, change: fn(&mut RenderSettings)| {
        let picture = stage.render(|s| {
            *s = gathering(100);
            change(s);
        });
        picture.check_finite("a picture");
        picture.stats.final_gather.skipped.join(" ")
    };
    let lit = room(rect_light(1.0, 1.0, 2.0));
    assert_eq!(reason(&lit, |_| {}), "");
    let mut dark = lit.clone();
    dark.lights.clear();
    assert!(reason(&dark, |_| {}).contains("no photons"));
    let mut all_specular = lit.clone();
    all_specular
        .materials
        .fill(preview(&[("metallic", &[1.0]), ("roughness", &[0.0])]));
    assert!(reason(&all_specular, |_| {}).contains("no photons"));
    let mut moving = lit.clone();
    moving.camera.shutter = [0.0, 1.0];
    moving.meshes[0] = Mesh::floor(2.0).moving(&[[0.0, 0.1, 0.0]]);
    assert!(reason(&moving, |_| {}).contains("moves"));
    let mut shining_points = lit.clone();
    shining_points.materials.push(black_emitter(1.0));
    shining_points.points.push(Points {
        material: 3,
        ..Points::new(&[[0.0, 1.5, 0.0]], 0.1)
    });
    assert!(reason(&shining_points, |_| {}).contains("emits"));
    assert!(reason(&lit, |s| s.max_depth = 1).contains("too short"));
    let pays = |s: &mut RenderSettings| s.photons.final_gathering = FinalGathering::WherePays;
    assert!(reason(&lit, pays).contains("too few samples"));
}
