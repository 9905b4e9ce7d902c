//! Emissive meshes that are closed: light is looked for on the side that the camera sees.

use kilauea_math::{DMat4, Vec2, Vec3, warp};
use kilauea_scene::Camera;
use kilauea_testing::uniforms;

use super::lit::{Lit, Sees, prepare, share_not_found};
use crate::PreparedScene;
use crate::light::{ByImportance, Receiver};

/// Flat pyramids with fronts outside, and with fronts inside, away from the camera at the origin.
fn lamps() -> [PreparedScene; 2] {
    let [a, b, c, apex] = [
        Vec3::new(-0.6, -0.3, 2.0),
        Vec3::new(0.5, -0.4, 2.0),
        Vec3::new(0.1, 0.6, 2.0),
        Vec3::new(0.1, 0.0, 2.2),
    ];
    let lamp = [[a, c, b], [a, b, apex], [b, c, apex], [c, a, apex]];
    let turned_over = lamp.map(|[a, b, c]| [a, c, b]);
    [lamp, turned_over].map(|lamp| prepare(Vec::new(), &lamp, Vec::new()))
}

fn seen_from(prepared: &PreparedScene, p: Vec3, n: Vec3) -> Lit<'_> {
    Lit {
        prepared,
        receiver: Receiver { p, n },
        chooser: ByImportance,
    }
}

#[test]
fn nothing_is_drawn_that_the_lamp_itself_hides() {
    for lamp in lamps() {
        for (p, n) in [
            (Vec3::new(0.3, 0.2, 2.3), Vec3::NEG_Z),
            (Vec3::new(0.1, -0.2, 1.9), Vec3::Z),
            (Vec3::new(4.0, 3.0, 1.0), Vec3::NEG_X),
        ] {
            let share = share_not_found(&seen_from(&lamp, p, n), 0);
            assert!(share < 2e-3, "{p}: {share}");
        }
    }
}

/// As it is in a worker that stays for the next frame.
#[test]
fn a_camera_that_moves_inside_has_the_light_there_looked_for() {
    for mut lamp in lamps() {
        let inside = Vec3::new(0.05, 0.0, 2.05);
        let is_looked_for = |lamp: &PreparedScene| {
            let seen = seen_from(lamp, inside, Vec3::Z);
            (0..100).any(|i| seen.sample(uniforms(43, i)).is_some())
        };
        assert!(!is_looked_for(&lamp));
        let camera = Camera {
            world_from_camera: DMat4::from_translation(inside.as_dvec3()),
            ..lamp.camera.clone()
        };
        lamp.set_camera(camera).expect("finite");
        assert!(is_looked_for(&lamp));
    }
}

/// No light is looked for on the hidden side, so rays that meet it count in full.
#[test]
fn rays_alone_find_what_is_inside() {
    for lamp in lamps() {
        let seen = seen_from(&lamp, Vec3::new(0.05, 0.0, 2.05), Vec3::Z);
        for i in 0..1000 {
            assert!(seen.sample(uniforms(41, i)).is_none());
            let dir = warp::uniform_sphere(Vec2::from_array(uniforms(42, i)));
            let mut n_found = 0;
            seen.for_each_arriving(dir, |emitted| {
                n_found += 1;
                assert_eq!(emitted.pdf, 0.0);
            });
            assert_eq!(n_found, 1, "{dir}");
        }
    }
}
