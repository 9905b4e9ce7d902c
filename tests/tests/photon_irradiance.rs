//! Irradiance by the density of photons, where it is known, and where paths find it.

use kilauea_math::{DMat4, Vec2, Vec3};
use kilauea_photon::{DensityRule, Kernel, Photon, PhotonMap, SurfaceQuery};
use kilauea_render::{
    ImportonRequest, LightShares, PhotonRequest, photon_benefit, photon_picture, trace_importons,
    trace_photons,
};
use kilauea_scene::{LightShape, Shading};
use kilauea_testing::{Family, Moments};
use kilauea_tests::{
    Mesh, Sphere, Stage, black_emitter, check_near, glass, light, looking_down, matte,
    orthographic, perspective, rect_light,
};
use std::f64::consts::PI;

/// A kernel whose mean over a patch is that of the irradiance.
const EVEN: DensityRule = DensityRule {
    kernel: Kernel::Constant,
    min_cos_normals: 0.5,
    max_plane_distance: 0.3,
};

fn photons(stage: &Stage, n_emitted: u32, seed: u32) -> Vec<Photon> {
    let request = PhotonRequest {
        n_emitted,
        max_depth: 64,
        seed,
        n_threads: 1,
        shading: Shading::Inline,
    };
    let traced = trace_photons(&stage.prepare(&Stage::settings()), &request);
    traced.expect("nothing fails").photons
}

/// The irradiance that each of several sets of photons finds at a place.
fn irradiances(sets: &[PhotonMap], query: SurfaceQuery, radius: f32) -> Moments {
    let found = sets.iter().map(|map| {
        let irradiance = map.irradiance(&query, radius, &EVEN);
        f64::from(irradiance.value.mean())
    });
    Moments::of(&found.collect::<Vec<_>>())
}

fn maps(stage: &Stage, n_emitted: u32, n_sets: u32) -> Vec<PhotonMap> {
    let map = |seed| PhotonMap::build(&photons(stage, n_emitted, seed));
    (0..n_sets).map(map).collect()
}

fn up(p: Vec3) -> SurfaceQuery {
    SurfaceQuery { p, n: Vec3::Y }
}

/// Irradiance at (x, z) below a rectangle of radiance one, `2a` by `2b` at height `h`: corners of
/// four rectangles that add up to it (Howell's catalog, C-10).
fn below_rect(a: f64, b: f64, h: f64, x: f64, z: f64) -> f64 {
    let corner = |x: f64, z: f64| {
        let term = |p: f64, q: f64| {
            let root = p.hypot(h);
            p / root * (q / root).atan()
        };
        0.5 * (term(x, z) + term(z, x))
    };
    corner(a - x, b - z) + corner(a + x, b - z) + corner(a - x, b + z) + corner(a + x, b + z)
}

#[test]
fn a_square_light_over_a_floor() {
    let mut stage = Stage::new(looking_down(0.0, 0.0));
    stage.materials.push(matte([0.5; 3]));
    stage.meshes.push(Mesh::floor(3.0));
    stage.lights.push(rect_light(1.0, 2.0, 1.0));
    let maps = maps(&stage, 10_000, 16);
    let mut family = Family::new("below a rect");
    let radius = 0.2_f32;
    for (x, z) in [(0.0, 0.0), (0.5, 0.3), (-1.2, 1.0), (0.2, -2.0)] {
        // The mean over the disk in which photons are counted.
        let mean: f64 = (0..400_u32)
            .map(|i| {
                let r = f64::from(radius) * ((f64::from(i) + 0.5) / 400.0).sqrt();
                let (sin, cos) = (2.399963 * f64::from(i)).sin_cos();
                below_rect(0.5, 1.0, 1.0, x + r * cos, z + r * sin) / 400.0
            })
            .sum();
        let found = irradiances(&maps, up(Vec3::new(x as f32, 0.0, z as f32)), radius);
        family.add(
            format!("{x} {z}: {} {mean}", found.mean),
            found.p_value(mean, 1e-3 * mean),
        );
        assert!(found.standard_error() < 0.05 * mean, "{found:?}");
    }
    family.check();
}

/// Albedo one half, and lamps of radiance one half before all walls: radiance one everywhere.
#[test]
fn a_furnace_has_irradiance_pi_everywhere() {
    let stage = Stage::box_of_light(matte([0.5; 3]));
    let maps = maps(&stage, 6_000, 16);
    let mut family = Family::new("furnace");
    for (p, n) in [
        (Vec3::new(0.0, -1.0, 0.0), Vec3::Y),
        (Vec3::new(0.6, -1.0, -0.5), Vec3::Y),
        (Vec3::new(-1.0, 0.2, 0.5), Vec3::X),
        (Vec3::new(0.3, -0.6, 1.0), Vec3::NEG_Z),
    ] {
        let found = irradiances(&maps, SurfaceQuery { p, n }, 0.3);
        let p_value = found.p_value(PI, 1e-3 * PI);
        family.add(format!("{p}: {}", found.mean), p_value);
    }
    family.check();
}

/// A convex body sees nothing but the dome.
#[test]
fn a_sphere_under_a_dome_has_irradiance_pi_everywhere() {
    let mut stage = Stage::new(perspective([0.0, 0.0, 4.0], [0.0; 3], 0.5));
    stage.materials.push(matte([0.5; 3]));
    stage.spheres.push(Sphere {
        center: [0.0; 3],
        radius: 1.0,
        material: 0,
    });
    stage.lights.push(light(LightShape::Dome, DMat4::IDENTITY));
    let maps = maps(&stage, 8_000, 12);
    let mut family = Family::new("sphere");
    for n in [Vec3::Y, Vec3::X, Vec3::new(1.0, -2.0, 2.0) / 3.0] {
        let found = irradiances(&maps, SurfaceQuery { p: n, n }, 0.2);
        // A disk of radius 0.2 is 1 % smaller than the cap within it of the sphere, and of that
        // facets take some back.
        family.add(format!("{n}: {}", found.mean), found.p_value(PI, 0.01 * PI));
    }
    family.check();
}

/// A box lit from its ceiling, seen from above without that.
fn open_box() -> Stage {
    let mut stage = Stage::new(orthographic([0.0, 0.9, 0.0], [0.0, -1.0, 0.0], 1.0));
    stage.materials.push(matte([0.6; 3]));
    stage.meshes.push(Mesh::cube());
    stage.lights.push(rect_light(0.8, 0.8, 0.95));
    stage
}

/// What paths find on the floor of a box, photons find too; where walls meet it, discs reach into
/// them, and the estimate is too low by a share in proportion to the radius.
#[test]
fn density_estimates_approach_what_paths_find() {
    let stage = open_box();
    let settings = Stage::settings();
    let by_paths = stage.render(|s| s.samples_per_pixel = 256);
    let prepared = stage.prepare(&settings);
    let importons = trace_importons(
        &prepared,
        &ImportonRequest {
            resolution: settings.resolution,
            block: 1,
            max_depth: 4,
            max_rough: 1,
            seed: 0,
            n_threads: 1,
        },
    )
    .expect("nothing fails");
    assert_eq!(importons.len(), 256);
    let map = PhotonMap::build(&photons(&stage, 60_000, 0));
    let mean_within = |radius: f32, half_width: f32| {
        let inner: Vec<_> = importons
            .iter()
            .filter(|i| Vec2::new(i.p.x, i.p.z).abs().max_element() < half_width)
            .collect();
        let [mut photons, mut paths] = [0.0; 2];
        for importon in &inner {
            let query = SurfaceQuery {
                p: importon.p,
                n: importon.n,
            };
            let irradiance = map.irradiance(&query, radius, &EVEN).value.mean();
            photons += f64::from(irradiance * importon.albedo.mean()) / PI;
            paths += f64::from(by_paths.channel("R")[importon.block as usize]);
        }
        photons / paths
    };
    // Away from the walls there is no bias worth mentioning.
    check_near(mean_within(0.2, 0.75), 1.0, 0.01, "within");
    let bias = [0.4, 0.2, 0.1].map(|radius| 1.0 - mean_within(radius, 1.0));
    assert!(bias[0] > 0.1 && bias[2] < 0.05, "{bias:?}");
    for (wide, narrow) in [(bias[0], bias[1]), (bias[1], bias[2])] {
        check_near(narrow / wide, 0.5, 0.25, "half the radius, half the bias");
    }
}

#[test]
fn pictures_of_photons_show_the_irradiance() {
    let stage = open_box();
    let prepared = stage.prepare(&Stage::settings());
    let all = photons(&stage, 40_000, 0);
    let picture = photon_picture(&prepared, &all, [16, 16], 1).expect("nothing fails");
    let mean = |name: &str| {
        let values = picture.channel(name).expect("the channel is there");
        values.iter().map(|&v| f64::from(v)).sum::<f64>() / 256.0
    };
    let by_paths = stage.render(|_| ()).mean();
    check_near(mean("R") / by_paths, 1.0, 0.06, "radiance");
    let from_irradiance = mean("irradiance.R") * 0.6 / PI;
    check_near(from_irradiance / mean("R"), 1.0, 1e-4, "irradiance");
    assert_eq!(mean("caustic.R"), 0.0);
    // Pixels of the floor are 2/16 wide, and count what is within a radius of half of that.
    let on_floor = all.iter().filter(|p| p.p.y < -0.999).count() as f64;
    let in_pixels = mean("photons.count") * 256.0;
    check_near(
        in_pixels / (on_floor * PI / 4.0),
        1.0,
        0.05,
        "photons of all pixels",
    );
}

#[test]
fn shares_say_where_light_comes_from() {
    let benefit = |stage: &Stage| {
        let request = PhotonRequest {
            n_emitted: 1 << 14,
            max_depth: 32,
            seed: 0,
            n_threads: 1,
            shading: Shading::Inline,
        };
        photon_benefit(&stage.prepare(&Stage::settings()), [64, 64], &request)
            .expect("nothing fails")
    };
    // A floor alone: all light is direct.
    let mut open = Stage::new(perspective([0.0, 3.0, 3.0], [0.0; 3], 0.5));
    open.materials = vec![matte([0.5; 3]), glass(&[("ior", &[1.5])])];
    open.meshes.push(Mesh::floor(2.0));
    open.lights.push(rect_light(0.5, 0.5, 4.0));
    let found = benefit(&open);
    assert_eq!(found.shares.direct, 1.0);
    assert!(!found.caustic && !found.global);
    assert_eq!(found.skipped.len(), 2);
    // A ball of glass on it makes caustics.
    open.spheres.push(Sphere {
        center: [0.0, 0.8, 0.0],
        radius: 0.5,
        material: 1,
    });
    let found = benefit(&open);
    assert!(found.caustic && !found.global, "{found:?}");
    // In a box of albedo 0.6, 0.6 of all light on its walls is indirect.
    let found = benefit(&open_box());
    assert!(!found.caustic && found.global, "{found:?}");
    check_near(found.shares.indirect, 0.5, 0.3, "a box");
    // No light, no shares.
    open.lights.clear();
    assert_eq!(benefit(&open).shares, LightShares::default());
    // Light that the camera sees itself is no matter of photons.
    let mut lamp = Stage::new(perspective([0.0, 0.0, 3.0], [0.0; 3], 0.5));
    lamp.materials = vec![black_emitter(1.0)];
    lamp.meshes.push(Mesh::cube());
    assert!(!benefit(&lamp).global);
}
