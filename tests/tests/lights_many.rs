//! Ten thousand lights.

use kilauea_math::hash::{mix32, unit_f32};
use kilauea_math::{DMat4, DVec3, Spectrum};
use kilauea_scene::{Light, LightShape};
use kilauea_tests::{Mesh, Stage, check_near, light, matte, orthographic};

const N_LIGHTS: u32 = 10_000;
const RADIUS: f64 = 0.005;
const HALF_WIDTH: f64 = 2.0;

/// A center above the floor and a radiance, all of which vary.
fn lights() -> Vec<(DVec3, f64)> {
    let number = |i: u32| f64::from(unit_f32(mix32(i)));
    (0..N_LIGHTS)
        .map(|i| {
            let [x, y, z, brightness] = [0, 1, 2, 3].map(|k| number(4 * i + k));
            let center = DVec3::new(6.0 * x - 3.0, 0.1 + 2.0 * y, 6.0 * z - 3.0);
            (center, 10.0 * brightness * brightness)
        })
        .collect()
}

/// Irradiance of each light where the normal is +y: π L r² cos / d², with all of the light above
/// the horizon.
fn irradiances(lights: &[(DVec3, f64)], p: DVec3) -> impl Iterator<Item = f64> {
    lights.iter().map(move |&(center, radiance)| {
        let to_light = center - p;
        let distance_sq = to_light.length_squared();
        let cos = to_light.y / distance_sq.sqrt();
        std::f64::consts::PI * radiance * RADIUS.powi(2) * cos / distance_sq
    })
}

#[test]
fn ten_thousand_lights_at_sixteen_samples() {
    let lights = lights();
    let mut stage = Stage::new(orthographic([0.0, 0.05, 0.0], [0.0; 3], HALF_WIDTH));
    stage.meshes.push(Mesh::floor(HALF_WIDTH as f32));
    stage.materials.push(matte([1.0; 3]));
    stage.lights = lights
        .iter()
        .map(|&(center, radiance)| Light {
            radiance: Spectrum::splat(radiance as f32),
            ..light(
                LightShape::Sphere { radius: RADIUS },
                DMat4::from_translation(center),
            )
        })
        .collect();
    let render = |samples_per_pixel| {
        stage.render(|s| {
            s.samples_per_pixel = samples_per_pixel;
            s.max_depth = 1;
        })
    };
    let picture = render(16);

    let (mut by_tree, mut uniform, mut expected) = (0.0, 0.0, 0.0);
    for (idx, &radiance) in picture.channel("G").iter().enumerate() {
        // Mean over sixteen points of the pixel.
        let pixel = 2.0 * HALF_WIDTH / 16.0;
        let points = (0..16).map(|k| {
            let x = (idx % 16) as f64 + (f64::from(k % 4) + 0.5) / 4.0;
            let z = (idx / 16) as f64 + (f64::from(k / 4) + 0.5) / 4.0;
            DVec3::new(x * pixel - HALF_WIDTH, 0.0, z * pixel - HALF_WIDTH)
        });
        let (mut mean, mut variance_of_uniform) = (0.0, 0.0);
        for p in points {
            let sum: f64 = irradiances(&lights, p).sum();
            let squares: f64 = irradiances(&lights, p).map(|e| e * e).sum();
            mean += sum / 16.0;
            variance_of_uniform += (f64::from(N_LIGHTS) * squares - sum * sum) / 16.0;
        }
        let found = f64::from(radiance) * std::f64::consts::PI;
        by_tree += (found / mean - 1.0).powi(2) / 256.0;
        uniform += variance_of_uniform / (mean * mean) / 16.0 / 256.0;
        expected += mean / 256.0 / std::f64::consts::PI;
    }
    eprintln!("relative variance at 16 samples: tree {by_tree}, uniform {uniform}");
    check_near(render(256).mean(), expected, 0.015, "mean");
    assert!(
        by_tree < 0.05 * uniform,
        "tree {by_tree}, uniform {uniform}"
    );
    assert!(by_tree < 0.1, "tree {by_tree}");
}
