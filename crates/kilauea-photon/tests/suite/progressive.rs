//! Radii that shrink.

use kilauea_math::{Spectrum, Vec3};
use kilauea_photon::{DensityRule, Photon, PhotonMap, ProgressiveRadius, SurfaceQuery};
use kilauea_testing::{Family, Moments};

use crate::photons::on_square;

const INITIAL_RADIUS: f32 = 0.3;

/// The radius of pass `n` of radii that begin with one.
fn radius_of_pass(n: u32) -> f64 {
    let mut radius = ProgressiveRadius::new(1.0);
    while radius.pass() < n {
        radius.advance();
    }
    f64::from(radius.radius())
}

#[test]
fn the_first_steps_are_those_of_the_formula() {
    assert_eq!(radius_of_pass(1), 1.0);
    let second_sq = f64::midpoint(1.0, 2.0 / 3.0);
    let third_sq = second_sq * (2.0 + 2.0 / 3.0) / 3.0;
    assert!((radius_of_pass(2).powi(2) - second_sq).abs() < 1e-7);
    assert!((radius_of_pass(3).powi(2) - third_sq).abs() < 1e-7);
}

#[test]
fn areas_fall_with_the_cube_root_of_the_pass() {
    let ratio = radius_of_pass(80_000).powi(2) / radius_of_pass(10_000).powi(2);
    assert!((ratio - 0.5).abs() < 1e-4, "{ratio}");
}

/// One watt on the unit square, with the irradiance 3 x².
fn ramp(seed: u32) -> Vec<Photon> {
    let n_photons = 500;
    let along_ramp = |photon: Photon| Photon {
        p: photon.p.with_x(photon.p.x.cbrt()),
        power: Spectrum::splat(1.0 / n_photons as f32),
        ..photon
    };
    let even = on_square(seed, n_photons);
    even.into_iter().map(along_ramp).collect()
}

/// Mean irradiance over the passes at x = 0.5, where it is 0.75.
fn mean_of_passes(run: u32, n_passes: u32) -> f64 {
    let mut radius = ProgressiveRadius::new(INITIAL_RADIUS);
    let mut sum = 0.0;
    for pass in 0..n_passes {
        let map = PhotonMap::build(&ramp(run * 1000 + pass));
        for y in [0.35, 0.5, 0.65] {
            let query = SurfaceQuery {
                p: Vec3::new(0.5, y, 0.0),
                n: Vec3::Z,
            };
            let found = map.irradiance(&query, radius.radius(), &DensityRule::default());
            sum += f64::from(found.value[0]) / 3.0;
        }
        radius.advance();
    }
    sum / f64::from(n_passes)
}

#[test]
fn the_bias_of_the_mean_falls_with_the_passes() {
    // The second moment of Epanechnikov's kernel along one axis is r² / 6, so the mean of 3 x² over
    // it is r² / 2 too high.
    let bias = |n_passes| {
        let areas = (1..=n_passes).map(|i| (f64::from(INITIAL_RADIUS) * radius_of_pass(i)).powi(2));
        areas.sum::<f64>() / f64::from(n_passes) / 2.0
    };
    assert!(bias(32) < 0.5 * bias(1));

    let mut family = Family::new("progressive irradiance of a ramp");
    for (n_passes, n_runs) in [(1, 400), (32, 60)] {
        let means: Vec<f64> = (0..n_runs)
            .map(|run| mean_of_passes(run, n_passes))
            .collect();
        let moments = Moments::of(&means);
        let case = format!("{n_passes} passes: {:.4}", moments.mean);
        assert!(
            moments.standard_error() < 0.2 * bias(n_passes),
            "{case}: too few to tell"
        );
        family.add(case, moments.p_value(0.75 + bias(n_passes), 0.0));
    }
    family.check();
}
