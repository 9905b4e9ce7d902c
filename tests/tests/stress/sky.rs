//! A sky that is one texel.

use kilauea_math::DMat4;
use kilauea_scene::LightShape;
use kilauea_tests::{Mesh, Stage, TileFile, check_near, light, matte, orthographic};
use std::f64::consts::{PI, TAU};

const SIZE: [u32; 2] = [256, 128];
const TEXEL: [u32; 2] = [100, 90];
const PEAK: f64 = 1e6;
const FLOOR: f64 = 0.1;

/// Irradiance over π of a floor that faces up: the filtered sky, integrated by the midpoint rule.
fn expected() -> f64 {
    const N: u32 = 64;
    let at =
        |texel: u32, i: u32| f64::from(texel) - 0.5 + 2.0 * (f64::from(i) + 0.5) / f64::from(N);
    let tent = |position: f64, texel: u32| {
        let distance = (position - f64::from(texel) - 0.5).abs();
        (1.0 - distance).max(0.0)
    };
    let cell =
        (2.0 / f64::from(N)).powi(2) * (TAU / f64::from(SIZE[0])) * (PI / f64::from(SIZE[1]));
    let mut sun = 0.0;
    for j in 0..N {
        let y = at(TEXEL[1], j);
        let theta = PI * (1.0 - y / f64::from(SIZE[1]));
        for i in 0..N {
            let share = tent(at(TEXEL[0], i), TEXEL[0]) * tent(y, TEXEL[1]);
            sun += share * (PEAK - FLOOR) * theta.sin() * theta.cos() * cell;
        }
    }
    FLOOR + sun / PI
}

/// One texel of a million over a dim sky: the mean is right, and no pixel is far from it, since
/// most samples go where the light is.
#[test]
fn one_texel_of_a_million_makes_no_fireflies() {
    let picture = TileFile::new(SIZE, |x, y| {
        [if [x, y] == TEXEL { PEAK } else { FLOOR } as f32; 3]
    });
    let mut stage = Stage::new(orthographic([0.0, 1.0, 0.0], [0.0; 3], 0.5));
    stage.materials = vec![matte([1.0; 3])];
    stage.meshes.push(Mesh::floor(1.0));
    stage.lights.push(light(LightShape::Dome, DMat4::IDENTITY));
    stage.lights[0].texture = Some(0);
    stage.textures.push(picture.source());
    let picture = stage.render(|s| {
        s.resolution = [32, 32];
        s.samples_per_pixel = 64;
    });
    picture.check_finite("sky");

    let mean = picture.mean();
    check_near(mean, expected(), 0.01, "mean");
    // Deviation of a sample, from the estimated variance of the pixels' means.
    let deviation = (picture.mean_of("variance") * 64.0).sqrt() / mean;
    let brightest = picture.channel("R").iter().copied().fold(0.0, f32::max);
    let brightest = (f64::from(brightest) / mean - 1.0) / (deviation / 8.0);
    super::report("sky", "mean over expected", mean / expected());
    super::report("sky", "deviation of a sample over the mean", deviation);
    super::report("sky", "brightest of 1024 pixels, in deviations", brightest);
    assert!(
        deviation < 1.5,
        "a sample deviates by {deviation} of the mean"
    );
    // Of a thousand normal numbers the largest is near 3.2.
    assert!(
        brightest < 6.0,
        "the brightest pixel is {brightest} deviations off"
    );
}
