use kilauea_math::{DAffine3, DMat3, DMat4, DVec3};
use kilauea_scene::{Camera, Projection};

/// A pinhole at `eye`; the picture reaches `half_width` to all sides at distance one.
pub fn perspective(eye: [f64; 3], target: [f64; 3], half_width: f64) -> Camera {
    let [eye, target] = [eye, target].map(DVec3::from_array);
    let backward = (eye - target).normalize();
    let up = if backward.cross(DVec3::Y).length() < 1e-6 {
        DVec3::NEG_Z
    } else {
        DVec3::Y
    };
    let right = up.cross(backward).normalize();
    let axes = DMat3::from_cols(right, backward.cross(right), backward);
    Camera {
        world_from_camera: DMat4::from(DAffine3::from_mat3_translation(axes, eye)),
        screen_window: [-half_width, -half_width, half_width, half_width],
        clipping_range: [1e-3, 1e5],
        ..Camera::default()
    }
}

/// Parallel rays; the picture reaches `half_width` scene units to all sides.
pub fn orthographic(eye: [f64; 3], target: [f64; 3], half_width: f64) -> Camera {
    Camera {
        projection: Projection::Orthographic,
        ..perspective(eye, target, half_width)
    }
}

/// Sees a hundredth of a unit of a floor at y = 0, from a quarter of a unit above the point (x, z).
pub fn looking_down(x: f64, z: f64) -> Camera {
    orthographic([x, 0.25, z], [x, 0.0, z], 0.005)
}
