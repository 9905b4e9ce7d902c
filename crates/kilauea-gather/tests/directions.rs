//! Directions drawn from fitted trees against the density that is stated for them, and fits against
//! what they were fitted to.

#![forbid(unsafe_code)]

use kilauea_gather::{Arrival, DirectionTree};
use kilauea_math::{Frame, Vec2, Vec3, warp};
use kilauea_testing::{Directions, Draw, Family, compare, uniforms};
use std::f32::consts::PI;

const N_DRAWS: u32 = 40_000;

fn square(stream: u32, i: u32) -> Vec2 {
    Vec2::from_array(uniforms(stream, i))
}

/// What a uniformly chosen direction finds in a field of radiance.
fn arrival(stream: u32, i: u32, radiance: impl Fn(Vec3) -> f32) -> Arrival {
    let wi = warp::uniform_sphere(square(stream, i));
    let pdf = 0.25 / PI;
    Arrival {
        wi,
        irradiance: radiance(wi) * wi.z.abs() / pdf,
        pdf,
    }
}

fn fit(n: u32, radiance: impl Fn(Vec3) -> f32) -> DirectionTree {
    let arrivals: Vec<_> = (0..n).map(|i| arrival(7, i, &radiance)).collect();
    DirectionTree::fit(&arrivals).expect("light arrives")
}

/// Light from a cone, over dim light from everywhere.
fn window(axis: Vec3, cos_angle: f32) -> impl Fn(Vec3) -> f32 {
    move |wi| if wi.dot(axis) > cos_angle { 10.0 } else { 0.1 }
}

#[test]
fn draws_have_the_stated_density() {
    let mut family = Family::new("direction trees");
    let axes = [Vec3::Z, -Vec3::Z, Vec3::new(0.6, -0.64, 0.48), Vec3::X];
    for (stream, axis) in (20..).zip(axes) {
        for n_arrivals in [1, 20_000] {
            let tree = fit(n_arrivals, window(axis, 0.9));
            let draw = |i| Draw::At(tree.sample(square(stream, i)));
            let density = |wi| f64::from(tree.pdf(wi));
            let sphere = Directions::around(axis, std::f64::consts::PI);
            let found = compare(&sphere, N_DRAWS, draw, density);
            family.add(
                format!("{n_arrivals} arrivals around {axis}"),
                found.p_value(),
            );
        }
    }
    family.check();
}

#[test]
fn a_lobe_is_what_draws_are_like() {
    for (axis, n_arrivals) in [
        (Vec3::Z, 20_000),
        (Vec3::X, 20_000),
        (-Vec3::Z, 20_000),
        (Vec3::Z, 1),
    ] {
        let tree = fit(n_arrivals, window(axis, 0.97));
        let lobe = tree.lobe();
        let drawn = (0..N_DRAWS).map(|i| tree.sample(square(30, i)));
        let mean = drawn.clone().sum::<Vec3>() / N_DRAWS as f32;
        assert!(lobe.mean.distance(mean) < 0.01, "{} {mean}", lobe.mean);
        let densest = drawn.map(|wi| 4.0 * PI * tree.pdf(wi)).fold(0.0, f32::max);
        let ratio = lobe.peak / densest;
        assert!(ratio > 0.85 && ratio < 1.01, "{ratio}");
    }
}

#[test]
fn every_direction_stays_possible() {
    let tree = fit(20_000, window(Vec3::Z, 0.99));
    for i in 0..10_000 {
        let pdf = tree.pdf(warp::uniform_sphere(square(3, i)));
        assert!(pdf > 1e-5 && pdf.is_finite(), "{pdf}");
    }
}

#[test]
fn drawing_from_a_fit_beats_drawing_from_the_cosine() {
    let radiance = window(Vec3::new(0.6, 0.0, 0.8), 0.97);
    let tree = fit(20_000, &radiance);
    let frame = Frame::from_z(Vec3::Z);
    let second_moment = |draw: &dyn Fn(u32) -> (Vec3, f32)| {
        let estimate = |i| {
            let (wi, pdf) = draw(i);
            f64::from((radiance(wi) * wi.z.max(0.0) / pdf).powi(2))
        };
        (0..N_DRAWS).map(estimate).sum::<f64>() / f64::from(N_DRAWS)
    };
    let by_cosine = second_moment(&|i| {
        let wi = frame.from_local(warp::cosine_hemisphere(square(4, i)));
        (wi, warp::cosine_hemisphere_pdf(wi.z))
    });
    let by_tree = second_moment(&|i| {
        let wi = tree.sample(square(5, i));
        (wi, tree.pdf(wi))
    });
    assert!(by_tree < 0.25 * by_cosine, "{by_tree} {by_cosine}");
}

#[test]
fn arrivals_without_light_make_no_tree() {
    let dark = arrival(7, 0, |_| 0.0);
    let broken = Arrival {
        irradiance: f32::NAN,
        ..dark
    };
    let infinite = Arrival {
        irradiance: f32::INFINITY,
        ..dark
    };
    let astray = Arrival {
        irradiance: 1.0,
        wi: Vec3::NAN,
        ..dark
    };
    for arrivals in [&[][..], &[dark], &[broken], &[infinite], &[astray]] {
        assert_eq!(DirectionTree::fit(arrivals), None);
    }
    // One that is sound among them does.
    let lit = arrival(7, 0, |_| 1.0);
    let alone = DirectionTree::fit(&[lit]);
    assert!(alone.is_some());
    assert_eq!(DirectionTree::fit(&[broken, lit, astray]), alone);
}
