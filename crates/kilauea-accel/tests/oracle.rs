//! Hits against brute force in `f64`.

mod shapes;

use kilauea_accel::{Hit, Ray};
use kilauea_math::{DAffine3, DVec3, Vec3};
use shapes::{Builds, Mesh, Random, grid, placed, soup};

/// Distance and least barycentric weight where the ray's line meets the triangle's plane.
fn meet(ray: &Ray, corners: [Vec3; 3]) -> (f64, f64) {
    let [a, b, c] = corners.map(|p| p.as_dvec3() - ray.origin.as_dvec3());
    let d = ray.dir.as_dvec3();
    let weights = DVec3::new(d.dot(c.cross(b)), d.dot(a.cross(c)), d.dot(b.cross(a)));
    let weights = weights / weights.element_sum();
    let p = weights.x * a + weights.y * b + weights.z * c;
    (p.dot(d) / d.dot(d), weights.min_element())
}

/// The hit must be on its triangle, and nothing clearly nearer.
fn check_hit(mesh: &Mesh, ray: &Ray, hit: Option<Hit>) {
    const SLACK: f64 = 2e-4;
    let range = f64::from(ray.t_min.max(0.0))..f64::from(ray.t_max);
    let t_hit = hit.map_or(range.end, |hit| f64::from(hit.t));
    if let Some(hit) = hit {
        let corners = mesh.corners(hit.primitive);
        let (t, least_weight) = meet(ray, corners);
        assert!(
            least_weight > -SLACK,
            "{ray:?} {hit:?}: off by {least_weight}"
        );
        assert!(
            (t - t_hit).abs() <= 1e-4 * t.max(1e-2),
            "{ray:?} {hit:?}: {t}"
        );
        let [a, b, c] = corners;
        let p = a + hit.u * (b - a) + hit.v * (c - a);
        let error = p.distance(ray.at(hit.t)) / (1.0 + p.length());
        assert!(error < 1e-5, "{ray:?} {hit:?}: position off by {error}");
    }
    for triangle in 0..mesh.indices.len() as u32 {
        let (t, least_weight) = meet(ray, mesh.corners(triangle));
        let is_nearer = t > range.start * (1.0 + 1e-5) + 1e-6 && t < t_hit * (1.0 - 1e-5);
        assert!(
            !(is_nearer && least_weight > SLACK),
            "{ray:?} {hit:?}: missed {triangle} at {t}, {least_weight} inside"
        );
    }
}

fn check(mesh: &Mesh, n_rays: usize, offset: Vec3) {
    let builds = Builds::of(mesh);
    let mut random = Random(1);
    let mut n_hits = 0;
    for i in 0..n_rays {
        let dir = match i % 8 {
            0 => [Vec3::X, Vec3::NEG_Y, Vec3::Z][i / 8 % 3],
            1 => Vec3::new(-0.0, random.unit() - 0.5, 0.3),
            2 => Vec3::new(1e-30, random.unit() - 0.5, -1e-20),
            _ => random.point(),
        };
        let mut ray = Ray::new(offset + 1.5 * random.point(), dir);
        if i % 5 == 0 {
            (ray.t_min, ray.t_max) = (0.5, 2.0);
        }
        let hit = builds.intersect(&ray);
        n_hits += usize::from(hit.is_some());
        check_hit(mesh, &ray, hit);
    }
    assert!(n_hits > n_rays / 40, "{n_hits} hits test little");
}

#[test]
fn one_triangle() {
    let mut mesh = Mesh::default();
    mesh.add([
        Vec3::new(-1.0, -1.0, 0.2),
        Vec3::new(2.0, -1.0, 0.0),
        Vec3::new(0.0, 2.0, -0.3),
    ]);
    check(&mesh, 2000, Vec3::ZERO);
}

#[test]
fn random_soups() {
    for (seed, n) in [2, 3, 5, 9, 17, 40, 300].into_iter().enumerate() {
        check(&soup(n, 1.0, seed as u32), 800, Vec3::ZERO);
    }
    check(&soup(1500, 0.2, 9), 500, Vec3::ZERO);
}

#[test]
fn far_from_the_origin() {
    for offset in [1e2, 1e4, 1e6] {
        let offset = Vec3::new(offset, -offset, 0.5 * offset);
        check(&soup(200, 0.8, 3).moved(offset), 800, offset);
    }
}

#[test]
fn needles_duplicates_and_planes() {
    let mut mesh = soup(60, 0.5, 5);
    let mut random = Random(7);
    for _ in 0..60 {
        let (a, b) = (random.point(), 2.0 * random.point());
        mesh.add([a, b, a + 3e-3 * random.point()]);
    }
    for triangle in 0..60 {
        let corners = mesh.corners(triangle);
        mesh.add(corners);
    }
    for _ in 0..40 {
        mesh.add([0; 3].map(|_| random.point().with_z(0.25)));
    }
    check(&mesh, 800, Vec3::ZERO);
}

#[test]
fn equal_distances_go_to_the_lowest_triangle() {
    let grid = grid(8);
    let builds = Builds::of(&grid);
    for x in 0..=16 {
        for y in 0..=16 {
            let p = Vec3::new(x as f32, y as f32, 0.0) / 2.0;
            for dir in [Vec3::new(0.0, -0.0, -2.0), Vec3::new(-0.0, 0.0, -2.0)] {
                let hit = builds
                    .intersect(&Ray::new(p + Vec3::Z, dir))
                    .unwrap_or_else(|| panic!("{p} missed"));
                let touches = |&triangle: &u32| {
                    let [a, b, c] = grid.corners(triangle);
                    let inside = |from: Vec3, to: Vec3| (to - from).perp_dot_xy(p - from) >= 0.0;
                    inside(a, b) && inside(b, c) && inside(c, a)
                };
                let lowest = (0..grid.indices.len() as u32).find(touches);
                assert_eq!((hit.t, Some(hit.primitive)), (0.5, lowest), "{p}");
            }
        }
    }
}

/// The vector kernels drop hits that are certainly out of range before the others look; at the
/// very ends of the range all must still agree.
#[test]
fn ranges_that_end_on_surfaces() {
    for scale in [1e-12, 1e-3, 1.0, 1e6] {
        let mut mesh = soup(150, 0.7, 2);
        for triangle in 0..150 {
            let [a, b, c] = mesh.corners(triangle);
            mesh.add([a, b, 0.5 * (a + b) + 1e-3 * (c - a)]);
        }
        for x in mesh.positions.iter_mut().flatten() {
            *x *= scale;
        }
        let far = DAffine3::from_translation(DVec3::splat(3e3 * f64::from(scale)));
        let twice = [DAffine3::IDENTITY, far].map(|transform| placed(0, transform));
        let several = [Builds::of(&mesh), Builds::new(&[mesh.geometry()], &twice)];
        let mut random = Random(4);
        let mut n_on_surface = 0;
        for _ in 0..1500 {
            let ray = Ray::new(2.0 * scale * random.point(), random.point());
            for builds in &several {
                let Some(hit) = builds.intersect(&ray) else {
                    continue;
                };
                let up_to = |t_max| builds.intersect(&Ray { t_max, ..ray });
                assert_eq!(up_to(hit.t), Some(hit));
                assert_eq!(up_to(hit.t.next_down()), None);
                let from = |t_min| builds.intersect(&Ray { t_min, ..ray });
                assert_eq!(from(hit.t.next_down()), Some(hit));
                assert_ne!(from(hit.t), Some(hit));
                let nudge = 1e-6 * scale * random.point();
                let on_surface = Ray::new(ray.at(hit.t) + nudge, random.point());
                n_on_surface += usize::from(builds.intersect(&on_surface).is_some());
            }
        }
        assert!(n_on_surface > 100, "{n_on_surface}");
    }
}

trait PerpDot {
    fn perp_dot_xy(self, other: Self) -> f32;
}

impl PerpDot for Vec3 {
    fn perp_dot_xy(self, other: Self) -> f32 {
        self.truncate().perp_dot(other.truncate())
    }
}
