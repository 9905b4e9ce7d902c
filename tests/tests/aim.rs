//! Paths that are aimed at small bright lights in mirrors, behind glass and in highlights.

use kilauea_math::Spectrum;
use kilauea_render::{Conditions, PreparedScene};
use kilauea_scene::{Aim, Light, LightShape, Material, PhotonSettings, RenderSettings, Shading};
use kilauea_testing::{Family, Moments, welch_p};
use kilauea_tests::{Mesh, Picture, Stage, facing_down, glass, light, matte, perspective, preview};
use std::sync::Arc;

/// A floor under a sun of that many degrees, and something that throws its light onto it.
fn stage(thrower: &[[f32; 3]], material: Material, angle_degrees: f64) -> Stage {
    let mut stage = Stage::new(perspective([0.0, 1.5, 3.0], [0.0, 0.0, 0.3], 0.3));
    stage.materials = vec![matte([0.7, 0.6, 0.5]), material];
    stage.meshes.push(Mesh::floor(2.0));
    stage.meshes.push(Mesh::polygon(thrower).with_material(1));
    stage.lights.push(sun(angle_degrees));
    stage
}

/// A wall that leans back behind the floor.
const WALL: [[f32; 3]; 4] = [
    [-1.0, 0.0, -0.5],
    [1.0, 0.0, -0.5],
    [1.0, 1.0, -1.1],
    [-1.0, 1.0, -1.1],
];
/// A pane above it.
const PANE: [[f32; 3]; 4] = [
    [-1.0, 1.0, -0.5],
    [-1.0, 1.0, 1.5],
    [1.0, 1.0, 1.5],
    [1.0, 1.0, -0.5],
];
/// A floor apart from the other, and a wall that leans back as the other does.
const SMALL_FLOOR: [[f32; 3]; 4] = [
    [4.95, 0.0, -0.4],
    [5.1, 0.0, -0.4],
    [5.1, 0.0, -0.5],
    [4.95, 0.0, -0.5],
];
const SMALL_WALL: [[f32; 3]; 4] = [
    [5.0, 0.0, -0.5],
    [5.05, 0.0, -0.5],
    [5.05, 0.05, -0.53],
    [5.0, 0.05, -0.53],
];

fn sun(angle_degrees: f64) -> Light {
    let half_angle = 0.5 * angle_degrees.to_radians();
    Light {
        // The same irradiance for any size.
        radiance: Spectrum::splat((1.0 / half_angle.sin().powi(2)) as f32),
        ..light(
            LightShape::Distant { angle_degrees },
            facing_down(0.0, 0.0, 0.0),
        )
    }
}

fn metal(roughness: f32) -> Material {
    preview(&[
        ("diffuseColor", &[0.9, 0.8, 0.7]),
        ("metallic", &[1.0]),
        ("roughness", &[roughness]),
    ])
}

/// Narrow highlights on a diffuse base.
fn plastic() -> Material {
    preview(&[
        ("diffuseColor", &[0.2, 0.3, 0.4]),
        ("useSpecularWorkflow", &[1.0]),
        ("specularColor", &[0.7, 0.7, 0.7]),
        ("roughness", &[0.15]),
    ])
}

fn settings(aim: Aim) -> RenderSettings {
    RenderSettings {
        resolution: [16, 16],
        samples_per_pixel: 16,
        max_depth: 6,
        photons: PhotonSettings {
            aim,
            ..PhotonSettings::default()
        },
        ..Stage::settings()
    }
}

/// Means of pictures of many seeds.
fn means(prepared: &Arc<PreparedScene>, settings: &RenderSettings, n_seeds: u32) -> Moments {
    let aim = settings.photons.aim;
    let mean = |seed| {
        let settings = RenderSettings {
            seed: 1000 * aim as u32 + seed,
            ..settings.clone()
        };
        let picture = Picture::render(prepared, settings);
        assert_eq!(
            picture.stats.aim.cells > 0,
            aim == Aim::Always,
            "{:?}",
            picture.stats.aim
        );
        picture.mean()
    };
    Moments::of(&(1..=n_seeds).map(mean).collect::<Vec<_>>())
}

/// Suns large enough for paths to find them by chance, so that both can be compared.
#[test]
fn aimed_paths_have_the_same_expectation() {
    let mut family = Family::new("aimed and not");
    for (what, thrower, material) in [
        ("a mirror", &WALL, metal(0.0)),
        ("a narrow metal", &WALL, metal(0.15)),
        ("plastic", &WALL, plastic()),
        ("glass", &PANE, glass(&[("ior", &[1.5])])),
    ] {
        let stage = stage(thrower, material, 40.0);
        let prepared = stage.prepare(&settings(Aim::Never));
        let by_chance = means(&prepared, &settings(Aim::Never), 12);
        let aimed = means(&prepared, &settings(Aim::Always), 12);
        family.add(what, welch_p(&by_chance, &aimed, 1e-4 * by_chance.mean));
    }
    family.check();
}

/// What a sun throws over a mirror onto a floor is found by one of some ten thousand paths that go
/// by the cosine.
#[test]
fn aimed_paths_find_the_sun_in_a_mirror() {
    let stage = stage(&WALL, metal(0.0), 2.0);
    let prepared = stage.prepare(&settings(Aim::Never));
    let by_chance = means(&prepared, &settings(Aim::Never), 32);
    let aimed = means(&prepared, &settings(Aim::Always), 8);
    assert!(
        aimed.variance < 0.1 * by_chance.variance,
        "{aimed:?} for {by_chance:?}"
    );
}

/// A small mirror beside a small floor, which one photon in twenty thousand meets; all others that
/// arrive do so from the same direction, elsewhere.
#[test]
fn aimed_paths_find_the_sun_where_no_photon_arrived() {
    let mut stage = stage(&WALL, metal(0.0), 2.0);
    stage.camera = perspective([5.02, 0.3, 0.2], [5.02, 0.0, -0.47], 0.02);
    stage.meshes.push(Mesh::polygon(&SMALL_FLOOR));
    stage
        .meshes
        .push(Mesh::polygon(&SMALL_WALL).with_material(1));
    let prepared = stage.prepare(&settings(Aim::Never));
    let by_chance = means(&prepared, &settings(Aim::Never), 32);
    let aimed = means(&prepared, &settings(Aim::Always), 8);
    assert!(
        aimed.variance < 0.1 * by_chance.variance,
        "{aimed:?} for {by_chance:?}"
    );
}

/// A mirror in a wide place, which some photons of the pilot meet: each round tells the next one better
/// where it is.
#[test]
fn a_mirror_that_few_photons_meet_is_aimed_at() {
    let settings = RenderSettings {
        resolution: [64, 64],
        ..settings(Aim::WherePays)
    };
    let mut stage = stage(&WALL, metal(0.0), 1.0);
    stage.meshes.push(Mesh::floor(10.0));
    let picture = Picture::render(&stage.prepare(&settings), settings);
    let aim = picture.stats.aim;
    assert!(aim.arrivals > 1000 && aim.cells > 0, "{aim:?}");
}

#[test]
fn how_it_is_run_does_not_change_a_bit() {
    let settings = RenderSettings {
        resolution: [40, 24],
        samples_per_pixel: 6,
        ..settings(Aim::Always)
    };
    let prepared = stage(&WALL, metal(0.0), 4.0).prepare(&settings);
    let render = |conditions, shading, threads| {
        let settings = RenderSettings {
            shading,
            threads,
            ..settings.clone()
        };
        Picture::render_under(conditions, &prepared, settings)
    };
    let inline = render(Conditions::default(), Shading::Inline, 1);
    assert!(inline.stats.aim.cells > 0, "{:?}", inline.stats.aim);
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

/// Paths find large lights by themselves, and a frame of few paths is not worth the photons.
#[test]
fn nothing_is_aimed_where_it_does_not_pay() {
    for (what, angle_degrees, resolution) in
        [("a large sun", 60.0, [64, 64]), ("few", 1.0, [16, 16])]
    {
        let plain = RenderSettings {
            resolution,
            ..settings(Aim::Never)
        };
        let default = RenderSettings {
            resolution,
            ..settings(Aim::WherePays)
        };
        let prepared = stage(&WALL, metal(0.0), angle_degrees).prepare(&plain);
        let picture = Picture::render(&prepared, default);
        assert_eq!(picture.stats.aim.cells, 0, "{what}");
        Picture::render(&prepared, plain).check_same_bits(&picture, what);
    }
}

#[test]
fn a_small_sun_is_aimed_at_without_being_asked() {
    let settings = RenderSettings {
        resolution: [64, 64],
        ..settings(Aim::WherePays)
    };
    let picture = Picture::render(&stage(&WALL, metal(0.0), 1.0).prepare(&settings), settings);
    assert!(picture.stats.aim.cells > 0, "{:?}", picture.stats.aim);
}
