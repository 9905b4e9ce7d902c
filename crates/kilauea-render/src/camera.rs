//! Camera rays.

use kilauea_accel::{PrimitiveId, Ray, Visibility};
use kilauea_math::{DMat4, DVec3, Vec2, Vec3, warp};
use kilauea_scene::{Camera, Projection};

use crate::geometry::keys::key_before;

/// The camera, ready to make rays in engine space.
#[derive(Clone, Debug)]
pub(crate) struct RayGenerator {
    projection: Projection,
    /// By motion key.
    poses: Vec<Pose>,
    window: [f32; 4],
    resolution: Vec2,
    lens_radius: f32,
    focus_distance: f32,
    clipping_range: [f32; 2],
    /// Growth of a pixel's width per unit of distance.
    spread: f32,
    /// Width of a pixel at the camera.
    width: f32,
}

/// Where paths through the middle of the lens begin, engine space.
pub(crate) fn eye(world_from_camera: &DMat4, origin_world: DVec3) -> Vec3 {
    (world_from_camera.transform_point3(DVec3::ZERO) - origin_world).as_vec3()
}

/// Eye and unit axes of the camera, engine space.
#[derive(Clone, Copy, Debug)]
struct Pose {
    eye: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
}

impl Pose {
    fn new(world_from_camera: &DMat4, origin_world: DVec3) -> Self {
        let m = world_from_camera;
        let axis = |v: DVec3| m.transform_vector3(v).as_vec3();
        Self {
            eye: eye(m, origin_world),
            right: axis(DVec3::X).normalize_or(Vec3::X),
            up: axis(DVec3::Y).normalize_or(Vec3::Y),
            forward: axis(DVec3::NEG_Z).normalize_or(Vec3::NEG_Z),
        }
    }

    /// The pose between two keys; the camera stays rigid.
    fn toward(&self, next: &Self, share: f32) -> Self {
        let mix = |a: Vec3, b: Vec3| a * (1.0 - share) + b * share;
        let forward = mix(self.forward, next.forward).normalize_or(self.forward);
        let right = mix(self.right, next.right).reject_from_normalized(forward);
        let right = right.normalize_or(self.right);
        Self {
            eye: mix(self.eye, next.eye),
            right,
            up: right.cross(forward),
            forward,
        }
    }
}

/// A point as a camera that does not move sees it through a point of its lens.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SeenPoint {
    /// Where in the picture, in pixels, y down.
    pub raster: Vec2,
    /// Unit vector to the camera.
    pub dir: Vec3,
    /// Distance to where camera rays begin, at the near clipping plane.
    pub distance: f32,
}

/// A camera ray; `ray.dir` has unit length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraRay {
    /// The ray.
    pub ray: Ray,
    /// Distance along the ray per unit of depth along the view axis.
    pub distance_per_depth: f32,
}

impl RayGenerator {
    /// `origin_world` is the world-space point at the origin of engine space.
    pub(crate) fn new(camera: &Camera, resolution: [u32; 2], origin_world: DVec3) -> Self {
        let later = &camera.later_world_from_camera;
        let keys = std::iter::once(&camera.world_from_camera).chain(later);
        let [left, bottom, right, top] = camera.screen_window.map(|x| x as f32);
        let resolution = Vec2::new(resolution[0] as f32, resolution[1] as f32);
        let pixel = ((right - left) / resolution.x)
            .min((top - bottom) / resolution.y)
            .abs();
        let (spread, width) = match camera.projection {
            Projection::Perspective => (pixel, 0.0),
            Projection::Orthographic => (0.0, pixel),
        };
        Self {
            projection: camera.projection,
            poses: keys.map(|key| Pose::new(key, origin_world)).collect(),
            window: [left, bottom, right, top],
            resolution,
            lens_radius: camera.lens_radius as f32,
            focus_distance: camera.focus_distance as f32,
            clipping_range: camera.clipping_range.map(|x| x as f32),
            spread,
            width,
        }
    }

    /// Width of a pixel after a distance, in scene units.
    #[inline]
    pub(crate) fn pixel_width(&self, distance: f32) -> f32 {
        self.width + self.spread * distance
    }

    /// Distance of a point (engine space) from where the camera is as the shutter opens.
    #[inline]
    pub(crate) fn distance(&self, p: Vec3) -> f32 {
        p.distance(self.pose(0.0).eye)
    }

    /// Whether rays need numbers for the lens.
    pub(crate) fn has_lens(&self) -> bool {
        self.lens_radius > 0.0 && self.focus_distance > 0.0
    }

    /// The ray through a raster point (pixels, y down) and a lens point in [0, 1)², at a time in
    /// [0, 1] over the shutter.
    #[inline]
    pub(crate) fn ray(&self, raster: Vec2, lens: Vec2, time: f32) -> CameraRay {
        let [left, bottom, right, top] = self.window;
        let s = raster / self.resolution;
        let x = left + s.x * (right - left);
        let y = top + s.y * (bottom - top);
        // Camera space: depth along +z here, so that directions read (x, y, 1).
        let (mut origin, mut toward) = match self.projection {
            Projection::Perspective => (Vec2::ZERO, Vec2::new(x, y)),
            Projection::Orthographic => (Vec2::new(x, y), Vec2::ZERO),
        };
        if self.has_lens() {
            let in_focus = origin + toward * self.focus_distance;
            let lens = self.lens_radius * warp::concentric_disk(lens);
            origin += lens;
            toward = (in_focus - origin) / self.focus_distance;
        }
        let pose = self.pose(time);
        let unnormalized = pose.right * toward.x + pose.up * toward.y + pose.forward;
        let distance_per_depth = unnormalized.length();
        CameraRay {
            ray: Ray {
                origin: pose.eye + pose.right * origin.x + pose.up * origin.y,
                dir: unnormalized / distance_per_depth,
                t_min: self.clipping_range[0] * distance_per_depth,
                t_max: self.clipping_range[1] * distance_per_depth,
                time,
                visibility: Visibility::CAMERA,
                from: PrimitiveId::NONE,
            },
            distance_per_depth,
        }
    }

    /// How the camera sees a point (engine space) through a lens point in [0, 1)², as the shutter opens.
    /// None outside of the clipping range. Whether the picture has that place is for the caller to know.
    pub(crate) fn see(&self, p: Vec3, lens: Vec2) -> Option<SeenPoint> {
        let pose = self.pose(0.0);
        let from_eye = p - pose.eye;
        let at = Vec2::new(from_eye.dot(pose.right), from_eye.dot(pose.up));
        let depth = from_eye.dot(pose.forward);
        let [near, far] = self.clipping_range;
        if !(depth > near && depth < far) {
            return None;
        }
        let lens = if self.has_lens() {
            self.lens_radius * warp::concentric_disk(lens)
        } else {
            Vec2::ZERO
        };
        // Where the ray begins, and where it is in the plane at depth one of one that begins at the eye.
        let (origin, toward) = match self.projection {
            Projection::Perspective => {
                let bent = if self.has_lens() {
                    lens / self.focus_distance
                } else {
                    Vec2::ZERO
                };
                (lens, (at - lens) / depth + bent)
            }
            Projection::Orthographic => {
                let slope = if self.has_lens() {
                    -lens / self.focus_distance
                } else {
                    Vec2::ZERO
                };
                (at - slope * depth, at - slope * depth - lens)
            }
        };
        let [left, bottom, right, top] = self.window;
        let s = (toward - Vec2::new(left, top)) / Vec2::new(right - left, bottom - top);
        let to_camera = pose.eye + pose.right * origin.x + pose.up * origin.y - p;
        let distance = to_camera.length();
        Some(SeenPoint {
            raster: s * self.resolution,
            dir: to_camera / distance,
            distance: distance * (1.0 - near / depth),
        })
    }

    /// Pixels that an area of a surface at `p` covers, over that area times the cosine at the surface, where
    /// a camera that does not move sees it along the unit vector `dir`, to or from the camera.
    #[inline]
    pub(crate) fn pixels_per_area(&self, p: Vec3, dir: Vec3) -> f32 {
        let pose = self.pose(0.0);
        let [left, bottom, right, top] = self.window;
        let window_area = ((right - left) * (top - bottom)).abs();
        let per_window = self.resolution.x * self.resolution.y / window_area;
        let cos_camera = dir.dot(pose.forward).abs();
        match self.projection {
            Projection::Perspective => {
                let depth = (p - pose.eye).dot(pose.forward);
                per_window / (depth * depth * cos_camera)
            }
            Projection::Orthographic => per_window / cos_camera,
        }
    }

    #[inline]
    fn pose(&self, time: f32) -> Pose {
        if let [still] = self.poses[..] {
            return still;
        }
        let (before, share) = key_before(self.poses.len(), time);
        self.poses[before].toward(&self.poses[before + 1], share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    fn camera(projection: Projection, screen_window: [f64; 4]) -> Camera {
        Camera {
            world_from_camera: DMat4::from_translation(DVec3::new(1e6, 2.0, 3.0)),
            projection,
            screen_window,
            clipping_range: [0.1, 100.0],
            ..Camera::default()
        }
    }

    #[test]
    fn corners_of_the_window_map_to_corners_of_the_raster() {
        let c = camera(Projection::Perspective, [-0.25, -0.5, 0.75, 0.5]);
        let g = RayGenerator::new(&c, [100, 100], DVec3::new(1e6, 0.0, 0.0));
        let upper_left = g.ray(Vec2::ZERO, Vec2::ZERO, 0.0);
        assert!(upper_left.ray.origin.distance(Vec3::new(0.0, 2.0, 3.0)) < 1e-6);
        let d = upper_left.ray.dir * upper_left.distance_per_depth;
        assert!(d.distance(Vec3::new(-0.25, 0.5, -1.0)) < 1e-6, "{d}");
    }

    #[test]
    fn orthographic_rays_are_parallel() {
        let c = camera(Projection::Orthographic, [-2.0, -1.0, 2.0, 1.0]);
        let g = RayGenerator::new(&c, [4, 2], DVec3::new(1e6, 0.0, 0.0));
        let r = g.ray(Vec2::new(4.0, 2.0), Vec2::ZERO, 0.0).ray;
        assert!(r.origin.distance(Vec3::new(2.0, 1.0, 3.0)) < 1e-6);
        assert_eq!(r.dir, Vec3::NEG_Z);
    }

    #[test]
    fn lens_rays_meet_in_the_focal_plane() {
        let mut c = camera(Projection::Perspective, [-0.5, -0.5, 0.5, 0.5]);
        (c.lens_radius, c.focus_distance) = (0.2, 5.0);
        let g = RayGenerator::new(&c, [10, 10], DVec3::new(1e6, 0.0, 0.0));
        let at_focus = |lens| {
            let r = g.ray(Vec2::new(2.0, 7.0), lens, 0.0);
            r.ray.origin + r.ray.dir * r.distance_per_depth * 5.0
        };
        let d = at_focus(Vec2::new(0.9, 0.1)).distance(at_focus(Vec2::new(0.2, 0.6)));
        assert!(d < 1e-5, "{d}");
    }

    /// Cameras of each projection, with and without a lens.
    fn cameras() -> impl Iterator<Item = RayGenerator> {
        let projections = [Projection::Perspective, Projection::Orthographic];
        let kinds = projections.map(|projection| [0.0, 0.3].map(|lens| (projection, lens)));
        kinds
            .into_iter()
            .flatten()
            .map(|(projection, lens_radius)| {
                let mut c = camera(projection, [-0.3, -0.5, 0.7, 0.4]);
                c.world_from_camera *= DMat4::from_rotation_x(0.3);
                (c.lens_radius, c.focus_distance) = (lens_radius, 4.0);
                RayGenerator::new(&c, [100, 70], DVec3::new(1e6, 0.0, 0.0))
            })
    }

    #[test]
    fn a_point_is_seen_where_its_ray_comes_from() {
        for g in cameras() {
            for raster in [Vec2::new(3.0, 60.0), Vec2::new(71.5, 20.25)] {
                let lens = Vec2::new(0.8, 0.35);
                let CameraRay {
                    ray,
                    distance_per_depth,
                } = g.ray(raster, lens, 0.0);
                let t = 7.0 * distance_per_depth;
                let seen = g.see(ray.at(t), lens).expect("within the clipping range");
                assert!(
                    seen.raster.distance(raster) < 1e-2,
                    "{:?} {raster:?}",
                    seen.raster
                );
                assert!(
                    seen.dir.distance(-ray.dir) < 1e-5,
                    "{:?} {:?}",
                    seen.dir,
                    ray.dir
                );
                assert!((seen.distance - (t - ray.t_min)).abs() < 1e-4);
            }
            assert!(
                g.see(
                    g.ray(Vec2::splat(9.0), Vec2::ZERO, 0.0).ray.at(0.05),
                    Vec2::ZERO
                )
                .is_none()
            );
        }
    }

    #[test]
    fn pixels_cover_as_much_as_their_rays_spread() {
        for g in cameras() {
            let (raster, lens) = (Vec2::new(71.5, 20.25), Vec2::new(0.8, 0.35));
            let at_depth = |raster| {
                let r = g.ray(raster, lens, 0.0);
                (r.ray.at(7.0 * r.distance_per_depth), r.ray.dir)
            };
            let (p, dir) = at_depth(raster);
            let [x, y] = [Vec2::X, Vec2::Y].map(|step| at_depth(raster + step).0 - p);
            // Across the view axis.
            let cross = x.cross(y);
            let cos_surface = (cross.normalize()).dot(dir).abs();
            let expected = 1.0 / (cross.length() * cos_surface);
            let found = g.pixels_per_area(p, dir);
            assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
        }
    }

    #[test]
    fn moving_cameras_pass_through_their_keys() {
        let mut c = camera(Projection::Perspective, [-0.5, -0.5, 0.5, 0.5]);
        c.world_from_camera = DMat4::IDENTITY;
        let quarter_turn = DMat4::from_rotation_y(std::f64::consts::FRAC_PI_2);
        c.later_world_from_camera = vec![
            DMat4::from_translation(DVec3::X),
            DMat4::from_translation(DVec3::X * 5.0) * quarter_turn,
        ];
        let g = RayGenerator::new(&c, [10, 10], DVec3::ZERO);
        let center = |time| g.ray(Vec2::splat(5.0), Vec2::ZERO, time).ray;
        assert_eq!(center(0.25).origin, Vec3::X * 0.5);
        assert_eq!(center(0.25).dir, Vec3::NEG_Z);
        assert!(center(1.0).origin.distance(Vec3::X * 5.0) < 1e-6);
        assert!(center(1.0).dir.distance(Vec3::NEG_X) < 1e-6);
        let between = center(0.75);
        assert!(between.origin.distance(Vec3::X * 3.0) < 1e-6);
        assert!(between.dir.distance(Vec3::new(-1.0, 0.0, -1.0).normalize()) < 1e-6);
        assert_eq!(between.time, 0.75);
    }
}
