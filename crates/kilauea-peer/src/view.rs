use kilauea_math::{DVec3, Vec3};
use kilauea_scene::{Camera, Projection};

use crate::Segment;

/// Where the rays of a picture start, and where its light is.
#[derive(Clone, Copy, Debug)]
pub struct View {
    eye: Vec3,
    /// Unit axes of the camera.
    right: Vec3,
    up: Vec3,
    forward: Vec3,
    projection: Projection,
    /// (left, bottom, right, top), at distance one for a perspective.
    window: [f32; 4],
    /// Nothing nearer along `forward` is seen.
    near: f32,
    /// What shadow rays aim at.
    pub(crate) light: Vec3,
}

impl View {
    /// A square picture from `eye` of what lies around `center`, with +z up.
    pub fn look_at(eye: Vec3, center: Vec3, half_width: f32, light: Vec3) -> Self {
        let forward = (center - eye).normalize();
        let right = forward.cross(Vec3::Z).normalize_or(Vec3::X);
        Self {
            eye,
            right,
            up: right.cross(forward),
            forward,
            projection: Projection::Perspective,
            window: [-half_width, -half_width, half_width, half_width],
            near: 0.0,
            light,
        }
    }

    /// A scene's camera without its lens, relative to `origin_world`.
    pub fn of_camera(camera: &Camera, origin_world: DVec3, light: Vec3) -> Self {
        let m = camera.world_from_camera;
        let axis = |v: DVec3| m.transform_vector3(v).as_vec3();
        Self {
            eye: (m.transform_point3(DVec3::ZERO) - origin_world).as_vec3(),
            right: axis(DVec3::X).normalize_or(Vec3::X),
            up: axis(DVec3::Y).normalize_or(Vec3::Y),
            forward: axis(DVec3::NEG_Z).normalize_or(Vec3::NEG_Z),
            projection: camera.projection,
            window: camera.screen_window.map(|x| x as f32),
            near: camera.clipping_range[0].max(0.0) as f32,
            light,
        }
    }

    /// Columns and rows of about `n_pixels` square pixels.
    pub(crate) fn resolution(&self, n_pixels: usize) -> [u32; 2] {
        let [left, bottom, right, top] = self.window;
        let aspect = ((right - left) / (top - bottom)).abs().clamp(0.1, 10.0);
        let height = (n_pixels as f32 / aspect).sqrt().round().max(1.0);
        [(height * aspect).round().max(1.0) as u32, height as u32]
    }

    /// The ray through a point of the picture, both coordinates from 0 to 1, y down.
    pub(crate) fn ray(&self, x: f32, y: f32) -> Segment {
        let [left, bottom, right, top] = self.window;
        let on_window =
            self.right * (left + x * (right - left)) + self.up * (top + y * (bottom - top));
        let (origin, toward) = match self.projection {
            Projection::Perspective => (self.eye, self.forward + on_window),
            Projection::Orthographic => (self.eye + on_window, self.forward),
        };
        Segment {
            t_min: self.near * toward.length(),
            ..Segment::new(origin, toward.normalize())
        }
    }
}
