//! Warps against the densities that they state.

#![forbid(unsafe_code)]

use kilauea_math::{INV_PI, Vec2, Vec3, warp};
use kilauea_testing::{Directions, Draw, Family, Rectangle, compare, uniforms};
use std::f64::consts::{FRAC_PI_2, PI};

const N_DRAWS: u32 = 40_000;

fn square(stream: u32, i: u32) -> Vec2 {
    Vec2::from_array(uniforms(stream, i))
}

#[test]
fn directions_have_their_densities() {
    let mut family = Family::new("warps to directions");
    let mut add =
        |case: String, half_angle, warp: &dyn Fn(Vec2) -> Vec3, pdf: &dyn Fn(Vec3) -> f64| {
            let stream = half_angle as u32;
            let draw = |i| Draw::At(warp(square(stream, i)));
            let found = compare(&Directions::around(Vec3::Z, half_angle), N_DRAWS, draw, pdf);
            family.add(case, found.p_value());
        };
    add(
        "cosine hemisphere".into(),
        FRAC_PI_2,
        &warp::cosine_hemisphere,
        &|w| f64::from(warp::cosine_hemisphere_pdf(w.z)),
    );
    add("sphere".into(), FRAC_PI_2, &warp::uniform_sphere, &|_| {
        0.25 / PI
    });
    for angle in [1e-3, 0.3, 1.0, 2.5, PI] {
        let cap = (2.0 * (0.5_f64 * angle).sin().powi(2)) as f32;
        let pdf = f64::from(warp::uniform_cone_pdf(cap));
        // The rim as the distance to the pole: cosines of small angles are all one.
        let is_inside = |w: Vec3| 0.5 * w.distance_squared(Vec3::Z) <= cap;
        add(
            format!("cone of {angle}"),
            angle.min(FRAC_PI_2),
            &|u| warp::uniform_cone(u, cap),
            &|w| if is_inside(w) { pdf } else { 0.0 },
        );
    }
    family.check();
}

#[test]
fn points_have_their_densities() {
    let mut family = Family::new("warps to the plane");
    let mut add = |case: &str, min: f32, warp: &dyn Fn(Vec2) -> Vec2, pdf: &dyn Fn(Vec2) -> f64| {
        let domain = Rectangle {
            min: Vec2::splat(min),
            max: Vec2::ONE,
        };
        let found = compare(&domain, N_DRAWS, |i| Draw::At(warp(square(9, i))), pdf);
        family.add(case, found.p_value());
    };
    add("disk", -1.0, &warp::concentric_disk, &|p| {
        if p.length_squared() <= 1.0 {
            f64::from(INV_PI)
        } else {
            0.0
        }
    });
    add("triangle", 0.0, &warp::uniform_triangle, &|p| {
        if p.x + p.y <= 1.0 { 2.0 } else { 0.0 }
    });
    family.check();
}
