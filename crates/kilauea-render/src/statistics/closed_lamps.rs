//! Emissive meshes that are closed: light is looked for on the side that the camera sees.

use kilauea_math::{Vec2, Vec3, warp};
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
