//! Instances that stretch, flatten and mirror by four orders of magnitude.

use kilauea_math::{DAffine3, DVec3};
use kilauea_scene::Camera;
use kilauea_tests::{Mesh, perspective};

use super::white;

#[test]
fn stretched_and_mirrored_instances_vanish_in_a_white_sky() {
    for (what, scale) in [
        ("flat", DVec3::new(1.0, 1e-4, 1.0)),
        ("needle", DVec3::new(1e-4, 1.0, 1e-4)),
        ("long", DVec3::new(1e4, 1.0, 1.0)),
        ("large", DVec3::new(1e4, 1e4, 1e-4)),
        ("mirrored", DVec3::new(-1.0, 1e-4, 1.0)),
        ("mirrored thrice", DVec3::new(-1e4, -1.0, -1e-4)),
    ] {
        // From where the unit sphere's image fills the picture.
        let size = scale.abs().max_element();
        let thickness = scale.abs().min_element();
        let eye = DVec3::new(0.3, 0.7, 1.0) * (2.5 * size);
        // Narrow enough that what is long and thin is in most pixels.
        let middle = scale.abs().element_sum() - size - thickness;
        let half_width = 0.2 * (middle / size).max(1e-4);
        let camera = perspective(eye.to_array(), [0.0; 3], half_width);
        let mut stage = white::stage(Camera {
            clipping_range: [1e-3 * thickness, 1e2 * size],
            ..camera
        });
        // Far apart, and askew, so that nothing is along an axis.
        let askew = DAffine3::from_rotation_y(0.4) * DAffine3::from_rotation_x(0.3);
        let place = askew * DAffine3::from_scale(scale);
        let elsewhere = DAffine3::from_translation(DVec3::X * (100.0 * size)) * place;
        white::place(&mut stage, Mesh::cube(), vec![place, elsewhere]);
        let most = white::check(&stage, 0.1, 1e-5, what);
        super::report("instances", format!("{what}, off by"), most);
    }
}
