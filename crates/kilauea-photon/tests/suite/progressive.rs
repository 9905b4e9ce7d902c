//! Radii that shrink.

use kilauea_photon::ProgressiveRadius;

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
