//! A dark room under a bright sky: any light in the picture came through the walls.

use kilauea_math::{DAffine3, DMat4, DVec3, Spectrum};
use kilauea_scene::{Camera, Light, LightShape};
use kilauea_tests::{Mesh, Stage, light, matte, perspective};

/// Where the room is.
struct Place {
    center: DVec3,
    half: DVec3,
    degrees: f64,
}

/// Light that got in, and the fraction of camera rays that met nothing.
fn leaks(place: &Place, is_instanced: bool) -> (f64, f64) {
    let Place {
        center,
        half,
        degrees,
    } = *place;
    let turned = DAffine3::from_rotation_y(degrees.to_radians());
    let world_from_room = DAffine3::from_translation(center) * turned * DAffine3::from_scale(half);
    let eye = |p: DVec3| world_from_room.transform_point3(p).to_array();
    // Into an edge, with a view so wide that it has all corners around it in sight.
    let camera = perspective(
        eye(DVec3::new(-0.2, 0.1, 0.3)),
        eye(DVec3::new(1.0, -0.4, 1.0)),
        2.0,
    );
    let size = half.max_element();
    let mut stage = Stage::new(Camera {
        clipping_range: [1e-6 * half.min_element(), 1e3 * size],
        ..camera
    });
    stage.materials = vec![matte([0.9; 3])];
    if is_instanced {
        let elsewhere = world_from_room * DAffine3::from_translation(4.0 * DVec3::X);
        super::white::place(&mut stage, Mesh::cube(), vec![world_from_room, elsewhere]);
    } else {
        stage.meshes.push(Mesh::cube().placed(world_from_room));
    }
    stage.lights.push(Light {
        radiance: Spectrum::splat(1e6),
        ..light(LightShape::Dome, DMat4::IDENTITY)
    });
    let picture = stage.render(|s| {
        s.resolution = [24, 24];
        s.samples_per_pixel = 16;
        s.max_depth = 8;
    });
    picture.check_finite("room");
    (picture.mean(), 1.0 - picture.mean_of("A"))
}

fn check(what: &str, place: &Place) {
    for is_instanced in [false, true] {
        let (light, open) = leaks(place, is_instanced);
        assert!(
            light == 0.0 && open == 0.0,
            "{what}, instanced {is_instanced}: {light:e} nits got in, {open:e} of the rays out"
        );
    }
    super::report("leaks", what, 0);
}

#[test]
fn rooms_of_any_size_are_dark() {
    for exponent in [-8, -6, -3, 0, 3, 6, 8] {
        let half = DVec3::splat(10.0_f64.powi(exponent));
        check(
            &format!("a room of 1e{exponent}"),
            &Place {
                center: DVec3::ZERO,
                half,
                degrees: 17.0,
            },
        );
    }
}

#[test]
fn rooms_anywhere_are_dark() {
    for exponent in 0..=7 {
        let offset = 10.0_f64.powi(exponent);
        check(
            &format!("a room at 1e{exponent}"),
            &Place {
                center: DVec3::new(offset, -0.7 * offset, 0.3 * offset),
                half: DVec3::ONE,
                degrees: 17.0,
            },
        );
    }
}

/// A room `aspect` times as long as it is wide, or as wide as it is high.
fn stretched(half: DVec3) -> Place {
    Place {
        center: DVec3::new(3.0, -1.0, 2.0),
        half,
        degrees: 17.0,
    }
}

#[test]
fn long_and_flat_rooms_are_dark() {
    for exponent in 1..=3 {
        let aspect = 10.0_f64.powi(exponent);
        check(
            &format!("a shaft 1e{exponent} times as long as wide"),
            &stretched(DVec3::new(1.0, aspect, 1.0)),
        );
        check(
            &format!("a slab 1e{exponent} times as wide as high"),
            &stretched(DVec3::new(aspect, 1.0, aspect)),
        );
    }
}

/// Where a wall is 1e4 times as long as wide, f32 has three digits left across it: a path that
/// comes as close to an edge as that may go on behind the wall next to it.
#[test]
fn rooms_far_longer_than_wide_let_little_light_in() {
    for is_instanced in [false, true] {
        let (light, open) = leaks(&stretched(DVec3::new(1.0, 1e4, 1.0)), is_instanced);
        assert_eq!(open, 0.0, "camera rays got out");
        let share = light / 1e6;
        assert!(share < 2e-4, "{share:e} of the sky got in");
        super::report("leaks", "a shaft of 1e4, share of the sky", share);
    }
}
