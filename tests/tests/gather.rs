//! The integrator `kilauea` finds the light that `path` finds, with everything that it learns in
//! use, however it is run.

use kilauea_math::{DMat4, Spectrum};
use kilauea_render::{Conditions, PreparedScene};
use kilauea_scene::{
    Aim, GlobalIllumination, Integrator, Light, LightShape, PhotonSettings, RenderSettings, Shading,
};
use kilauea_testing::{Family, Moments, welch_p};
use kilauea_tests::{
    Mesh, Picture, Stage, facing_down, glass, light, matte, orthographic, perspective, rect_light,
};
use std::sync::Arc;

const N_SEEDS: u32 = 12;
/// What paths can be told.
const LEARNT: [&str; 2] = ["guided_directions", "guided_lights"];
/// Differences below this share are those of rounding.
const RESOLUTION: f64 = 3e-5;

/// A glossy ball on a floor beside a red wall, under a lamp and a dome.
fn stage() -> Stage {
    let mut stage = Stage::sphere_beside_wall();
    stage.lights = vec![rect_light(0.5, 0.5, 2.0), dome()];
    stage
}

fn dome() -> Light {
    Light {
        radiance: Spectrum::splat(0.05),
        ..light(LightShape::Dome, DMat4::IDENTITY)
    }
}

/// Everything that is learnt is used, whether it pays or not.
fn forced() -> RenderSettings {
    RenderSettings {
        resolution: [16, 16],
        samples_per_pixel: 16,
        max_depth: 5,
        integrator: Integrator::Kilauea,
        general: LEARNT.map(String::from).into(),
        ..Stage::settings()
    }
}

fn moments(
    prepared: &Arc<PreparedScene>,
    settings: &RenderSettings,
    first_seed: u32,
) -> Vec<Moments> {
    let quarters = |seed| {
        let settings = RenderSettings {
            seed,
            ..settings.clone()
        };
        let picture = Picture::render(prepared, settings);
        let mut means = [0.0; 4];
        for channel in ["R", "G", "B"] {
            for (idx, &value) in picture.channel(channel).iter().enumerate() {
                means[idx / 128 * 2 + idx % 16 / 8] += f64::from(value);
            }
        }
        means
    };
    let pictures: Vec<[f64; 4]> = (first_seed..first_seed + N_SEEDS).map(quarters).collect();
    let of_quarter = |i: usize| Moments::of(&pictures.iter().map(|p| p[i]).collect::<Vec<_>>());
    (0..4).map(of_quarter).collect()
}

#[test]
fn both_integrators_have_one_expectation() {
    let mut family = Family::new("integrators");
    let mut with_glass = stage();
    with_glass.materials.push(glass(&[]));
    with_glass.spheres[0].material = 3;
    for (what, stage, aim) in [
        ("plastic", stage(), Aim::WherePays),
        ("glass", with_glass.clone(), Aim::WherePays),
        ("glass, aimed", with_glass, Aim::Always),
    ] {
        let settings = RenderSettings {
            photons: PhotonSettings {
                aim,
                ..PhotonSettings::default()
            },
            ..forced()
        };
        let prepared = stage.prepare(&settings);
        let path = RenderSettings {
            integrator: Integrator::Path,
            ..settings.clone()
        };
        let expected = moments(&prepared, &path, 0);
        let found = moments(&prepared, &settings, 100);
        let learnt = Picture::render(&prepared, settings).stats;
        assert!(learnt.gather.cells > 0 && learnt.gather.light_cells > 0);
        assert_eq!(learnt.aim.cells > 0, aim == Aim::Always, "{what}");
        for (quarter, (a, b)) in expected.iter().zip(&found).enumerate() {
            let p = welch_p(a, b, RESOLUTION * a.mean);
            family.add(format!("{what}, quarter {quarter}"), p);
        }
    }
    family.check();
}

#[test]
fn merging_with_photons_has_one_expectation_whatever_paths_know() {
    let mut stage = stage();
    stage.materials.push(glass(&[]));
    stage.spheres[0].material = 3;
    let told = RenderSettings {
        gi: GlobalIllumination::Consistent,
        photons: PhotonSettings {
            radius: Some(0.05),
            ..PhotonSettings::default()
        },
        ..forced()
    };
    let path = RenderSettings {
        integrator: Integrator::Path,
        ..told.clone()
    };
    let prepared = stage.prepare(&told);
    let picture = Picture::render(&prepared, told.clone());
    let stats = &picture.stats;
    assert!(stats.photons.stored > 0);
    assert!(stats.gather.light_cells > 0 && stats.gather.cells > 0);
    let mut family = Family::new("merging");
    let expected = moments(&prepared, &path, 0);
    let found = moments(&prepared, &told, 100);
    for (quarter, (a, b)) in expected.iter().zip(&found).enumerate() {
        let p = welch_p(a, b, RESOLUTION * a.mean);
        family.add(format!("quarter {quarter}"), p);
    }
    family.check();
}

#[test]
fn how_it_is_run_does_not_change_a_bit() {
    let settings = RenderSettings {
        resolution: [40, 24],
        samples_per_pixel: 6,
        ..forced()
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
    assert!(inline.mean() > 0.01 && inline.stats.gather.records > 100);
    let gather = &inline.stats.gather;
    assert!(gather.choices > 100 && gather.cells > 0 && gather.light_cells > 0);
    for learnt in LEARNT {
        assert!(inline.stats.needs.contains(&learnt.into()), "{learnt}");
    }
    let plain_loop = Conditions {
        plain_loop: true,
        ..Conditions::default()
    };
    for (what, conditions, shading, threads) in [
        ("two threads", Conditions::default(), Shading::Inline, 2),
        ("seven threads", Conditions::default(), Shading::Inline, 7),
        ("a plain loop", plain_loop, Shading::Inline, 2),
        ("queues", Conditions::default(), Shading::Queued, 2),
        ("bytes", Conditions::default(), Shading::Bytes, 2),
    ] {
        inline.check_same_bits(&render(conditions, shading, threads), what);
    }
}

#[test]
fn in_a_furnace_nothing_is_lost() {
    // A white ball in white light is white, and so is what is seen of it by every path.
    let mut stage = Stage::new(perspective([0.0, 0.0, 3.0], [0.0; 3], 0.2));
    stage.materials.push(matte([1.0; 3]));
    stage.meshes.push(Mesh::cube());
    stage.lights.push(light(LightShape::Dome, DMat4::IDENTITY));
    let picture = stage.render(|s| {
        *s = RenderSettings {
            samples_per_pixel: 64,
            ..forced()
        }
    });
    kilauea_tests::check_near(picture.mean(), 1.0, 0.01, "a white ball");
}

#[test]
fn where_nothing_is_to_be_learnt_paths_are_plain() {
    let settings = RenderSettings {
        general: Vec::new(),
        ..forced()
    };
    let path = RenderSettings {
        integrator: Integrator::Path,
        ..settings.clone()
    };
    // Without light, and without a surface that light could be sought from.
    let mut dark = stage();
    dark.lights.clear();
    for (stage, max_depth) in [(dark, 5), (stage(), 0)] {
        let prepared = stage.prepare(&settings);
        let render = |settings: &RenderSettings| {
            let settings = RenderSettings {
                max_depth,
                ..settings.clone()
            };
            Picture::render(&prepared, settings)
        };
        let (kilauea, path) = (render(&settings), render(&path));
        for learnt in LEARNT {
            assert!(kilauea.stats.skipped.contains(&learnt.into()), "{learnt}");
        }
        kilauea.check_same_bits(&path, "plain paths");
    }
}

/// A floor in four parts, with walls between them and nine lamps close to where they meet in each: all
/// lamps are about as far from any place, and a quarter of them is seen.
fn four_rooms() -> Stage {
    let mut stage = Stage::new(orthographic([0.0, 3.0, 0.0], [0.0; 3], 2.0));
    stage.materials.push(matte([0.8; 3]));
    stage.meshes.push(Mesh::floor(2.0));
    for [x, z] in [[0.0, 2.0], [2.0, 0.0]] {
        let corners = [[-x, 0.0, -z], [x, 0.0, z], [x, 2.0, z], [-x, 2.0, -z]];
        stage.meshes.push(Mesh::polygon(&corners));
    }
    let lamp = LightShape::Rect {
        width: 0.05,
        height: 0.05,
    };
    let along = [-0.5, -0.3, -0.1, 0.1, 0.3, 0.5];
    for [x, z] in along.into_iter().flat_map(|x| along.map(|z| [x, z])) {
        let place = facing_down(x, 0.5, z);
        stage.lights.push(Light {
            radiance: Spectrum::splat(100.0),
            ..light(lamp, place)
        });
    }
    stage
}

#[test]
fn what_samples_share_out_evenly_is_left_to_them() {
    let settings = RenderSettings {
        resolution: [96, 96],
        samples_per_pixel: 8,
        max_depth: 1,
        ..Stage::settings()
    };
    let prepared = four_rooms().prepare(&settings);
    let render = |integrator| {
        let settings = RenderSettings {
            integrator,
            ..settings.clone()
        };
        Picture::render(&prepared, settings)
    };
    let (kilauea, path) = (render(Integrator::Kilauea), render(Integrator::Path));
    let gather = &kilauea.stats.gather;
    assert!(gather.choices_in_vain > 0.3, "{gather:?}");
    assert!(gather.gain_of_lights < 1.1, "{gather:?}");
    kilauea.check_same_bits(&path, "direct light alone");
}

#[test]
fn a_first_look_is_all_where_there_is_nothing_to_hope_for() {
    let mut stage = stage();
    stage.lights.truncate(1);
    let picture = stage.render(|s| {
        *s = RenderSettings {
            resolution: [96, 96],
            samples_per_pixel: 32,
            general: Vec::new(),
            ..forced()
        }
    });
    let n_paths = 96 * 96 * 32;
    let gather = &picture.stats.gather;
    assert!(
        gather.paths > 0 && gather.paths < n_paths / 400,
        "{gather:?}"
    );
    assert_eq!((gather.choices, gather.pixels_tried), (0, 0));
}
