use kilauea_math::{DMat4, DVec3, Vec2};
use kilauea_scene::Camera;
use kilauea_testing::{Draw, Family, Rectangle, compare, uniforms};
use std::f64::consts::PI;

use crate::camera::RayGenerator;

const N_DRAWS: u32 = 40_000;

fn generator(camera: &Camera) -> RayGenerator {
    RayGenerator::new(camera, [64, 64], DVec3::ZERO)
}

/// p-value of where rays leave a lens of radius `radius`, against the density of another.
fn lens_p_value(radius: f64, stated_radius: f64) -> f64 {
    let camera = generator(&Camera {
        lens_radius: radius,
        focus_distance: 3.0,
        ..Camera::default()
    });
    let extent = radius.max(stated_radius) as f32;
    let domain = Rectangle {
        min: Vec2::splat(-extent),
        max: Vec2::splat(extent),
    };
    let draw = |i| {
        let [x, y, u, v] = uniforms(0, i);
        let raster = 64.0 * Vec2::new(x, y);
        let ray = camera.ray(raster, Vec2::new(u, v), 0.0).ray;
        Draw::At(ray.origin.truncate())
    };
    let density = |p: Vec2| {
        if p.length() <= stated_radius as f32 {
            1.0 / (PI * stated_radius.powi(2))
        } else {
            0.0
        }
    };
    compare(&domain, N_DRAWS, draw, density).p_value()
}

#[test]
fn rays_leave_the_lens_evenly() {
    assert!(lens_p_value(0.4, 0.4) > 1e-3);
    assert!(lens_p_value(0.4, 0.404) < 1e-6);
    assert!(lens_p_value(0.404, 0.4) < 1e-6);
}

#[test]
fn directions_fill_the_screen_evenly() {
    let mut family = Family::new("screens");
    for (lens_radius, focus_distance) in [(0.0, 0.0), (0.2, 2.5)] {
        let camera = generator(&Camera {
            lens_radius,
            focus_distance,
            ..Camera::default()
        });
        // Where rays meet the plane of focus, at distance one the window from −1/2 to 1/2.
        let distance = if focus_distance > 0.0 {
            focus_distance as f32
        } else {
            1.0
        };
        let domain = Rectangle {
            min: Vec2::splat(-0.5 * distance),
            max: Vec2::splat(0.5 * distance),
        };
        let draw = |i| {
            let [x, y, u, v] = uniforms(1, i);
            let made = camera.ray(64.0 * Vec2::new(x, y), Vec2::new(u, v), 0.0);
            let at = made.ray.at(distance * made.distance_per_depth);
            Draw::At(at.truncate().clamp(domain.min, domain.max))
        };
        let density = f64::from(distance).powi(-2);
        let found = compare(&domain, N_DRAWS, draw, |_| density);
        family.add(format!("lens {lens_radius}"), found.p_value());
    }
    family.check();
}

#[test]
fn a_moving_camera_spends_its_time_evenly() {
    // Three keys, a third and two thirds of the way in half of the time each.
    let at = |x| DMat4::from_translation(DVec3::new(x, 0.0, 0.0));
    let camera = generator(&Camera {
        later_world_from_camera: vec![at(1.0), at(3.0)],
        ..Camera::default()
    });
    let domain = Rectangle {
        min: Vec2::ZERO,
        max: Vec2::new(3.0, 1.0),
    };
    let draw = |i| {
        let [time, y] = uniforms(2, i);
        let ray = camera.ray(Vec2::splat(32.0), Vec2::splat(0.5), time).ray;
        Draw::At(Vec2::new(ray.origin.x, y))
    };
    let slow_first = |p: Vec2| if p.x < 1.0 { 0.5 } else { 0.25 };
    assert!(compare(&domain, N_DRAWS, draw, slow_first).p_value() > 1e-3);
    let even = |_| 1.0 / 3.0;
    assert!(compare(&domain, N_DRAWS, draw, even).p_value() < 1e-6);
}
