//! No ray leaves a closed mesh between its triangles.

mod shapes;

use kilauea_accel::Ray;
use kilauea_math::Vec3;
use shapes::{Builds, Mesh, Random, bumpy_sphere, cube};

/// From a point inside, shoots at corners, edges and faces.
fn check(mesh: &Mesh, inside: Vec3, reach: f32, n_rays: usize) {
    let builds = Builds::of(mesh);
    let mut random = Random(3);
    // Targets between corners are rounded to the surroundings of the surface.
    let t_most = 1.01 + 5e-7 * inside.length();
    for i in 0..n_rays {
        let [a, b, c] = mesh.corners(random.index(mesh.indices.len()) as u32);
        let target = match i % 4 {
            0 => a,
            1 => 0.5 * (a + b),
            2 => a + random.unit() * (b - a),
            _ => (a + b + c) / 3.0,
        };
        let origin = inside + reach * random.point();
        let ray = Ray::new(origin, target - origin);
        let hit = builds.intersect(&ray);
        assert!(hit.is_some(), "{ray:?} escapes towards {target}");
        assert!(
            hit.is_some_and(|hit| hit.t < t_most),
            "{ray:?} passes {target}: {hit:?}"
        );
    }
}

#[test]
fn sphere() {
    check(&bumpy_sphere(24), Vec3::ZERO, 0.5, 6000);
}

#[test]
fn sphere_far_from_the_origin() {
    for offset in [1e3, 1e5, 1e6] {
        let offset = Vec3::new(offset, 0.3 * offset, -offset);
        check(&bumpy_sphere(12).moved(offset), offset, 0.25, 2000);
    }
}

#[test]
fn tiny_and_huge_spheres() {
    for scale in [1e-12, 1e10] {
        let mut mesh = bumpy_sphere(12);
        for p in &mut mesh.positions {
            *p = p.map(|x| x * scale);
        }
        check(&mesh, Vec3::ZERO, 0.5 * scale, 1000);
    }
}

#[test]
fn cube_along_its_axes() {
    let builds = Builds::of(&cube());
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        for dir in [axis, -axis] {
            for steps in 0..125 {
                let [x, y, z] = [steps % 5, steps / 5 % 5, steps / 25].map(|i| i as f32 / 4.0);
                let p = Vec3::new(x, y, z);
                let start = p - 3.0 * dir;
                let t = 3.0 - p.dot(dir) + if dir == axis { 0.0 } else { -1.0 };
                let hit = builds.intersect(&Ray::new(start, dir));
                assert_eq!(hit.map(|hit| hit.t), Some(t), "from {start} along {dir}");
            }
        }
    }
}

#[test]
fn from_far_away() {
    let mesh = bumpy_sphere(12);
    let builds = Builds::of(&mesh);
    let mut random = Random(11);
    for _ in 0..1000 {
        let origin = 1e6 * random.point().normalize();
        let ray = Ray::new(origin, 0.3 * random.point() - origin);
        assert!(builds.intersect(&ray).is_some(), "{ray:?}");
    }
}
