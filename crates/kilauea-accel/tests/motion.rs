//! Moving meshes: closed at any time, and still at the keys.

mod shapes;

use kilauea_accel::{Geometry, Mesh, Ray, Visibility};
use kilauea_math::{DAffine3, Vec3};
use shapes::{Builds, Random, bumpy_sphere, placed};

/// Every corner of a mesh moved by up to `size`, those in the same place alike.
fn shaken(positions: &[[f32; 3]], size: f32) -> Vec<[f32; 3]> {
    let moved = |&[x, y, z]: &[f32; 3]| {
        let by = [13.0 * y, 17.0 * z, 11.0 * x].map(f32::sin);
        [x + size * by[0], y + size * by[1], z + size * by[2]]
    };
    positions.iter().map(moved).collect()
}

fn moving<'a>(positions: Vec<&'a [[f32; 3]]>, triangles: &'a [[u32; 3]]) -> Geometry<'a> {
    Geometry {
        meshes: vec![Mesh {
            positions,
            triangles,
            visibility: Visibility::ALL,
        }],
        ..Geometry::default()
    }
}

/// Rays from inside to edges and corners, where neighbours meet, never pass between them.
#[test]
fn closed_meshes_are_closed_at_any_time() {
    let mesh = bumpy_sphere(12);
    let mut random = Random(1);
    let later = shaken(&mesh.positions, 0.04);
    let last = shaken(&later, 0.04);
    let keys = [&mesh.positions[..], &later, &last];
    let builds = Builds::new(
        &[moving(keys.to_vec(), &mesh.indices)],
        &[placed(0, DAffine3::IDENTITY)],
    );
    for i in 0..4000 {
        let time = random.unit();
        let key = usize::from(time >= 0.5);
        let fraction = 2.0 * time - key as f32;
        let corner = |corner: u32| {
            let [a, b] = [key, key + 1].map(|k| Vec3::from_array(keys[k][corner as usize]));
            a.lerp(b, fraction)
        };
        let [a, b, _] = mesh.indices[random.index(mesh.indices.len())].map(corner);
        let along = if i % 2 == 0 { 0.0 } else { random.unit() };
        let origin = 0.3 * random.point();
        let ray = Ray {
            time,
            ..Ray::new(origin, a.lerp(b, along) - origin)
        };
        assert!(builds.intersect(&ray).is_some(), "{ray:?} escapes");
    }
}

/// At its keys a moving mesh gives the very hits of the still mesh there.
#[test]
fn moving_meshes_are_the_still_ones_at_the_keys() {
    let mesh = bumpy_sphere(8);
    let mut random = Random(2);
    let later = shaken(&mesh.positions, 0.1);
    let last = shaken(&later, 0.1);
    let keys = [&mesh.positions[..], &later, &last];
    let place = [placed(0, DAffine3::IDENTITY)];
    let still = keys.map(|key| Builds::new(&[moving(vec![key], &mesh.indices)], &place));
    let moving = Builds::new(&[moving(keys.to_vec(), &mesh.indices)], &place);
    let mut n_hits = 0;
    for _ in 0..1000 {
        let origin = 2.0 * random.point();
        let ray = Ray::new(origin, random.point() - origin);
        for (key, time) in [(0, 0.0), (1, 0.5)] {
            let hit = moving.intersect(&Ray { time, ..ray });
            assert_eq!(hit, still[key].intersect(&ray), "{ray:?} at key {key}");
            n_hits += usize::from(hit.is_some());
        }
        // a + 1 (b - a) may be next to b.
        let (hit, expected) = (
            moving.intersect(&Ray { time: 1.0, ..ray }),
            still[2].intersect(&ray),
        );
        if let (Some(hit), Some(expected)) = (hit, expected) {
            assert!((hit.t - expected.t).abs() < 1e-4 * expected.t.max(1e-2));
        }
    }
    assert!(n_hits > 300, "{n_hits}");
}

/// What moves away from a ray during the shutter is hit before, not after.
#[test]
fn times_out_of_range_are_those_of_the_ends() {
    let mesh = bumpy_sphere(6);
    let later: Vec<[f32; 3]> = mesh
        .positions
        .iter()
        .map(|p| (Vec3::from_array(*p) + 10.0 * Vec3::X).to_array())
        .collect();
    let keys = vec![&mesh.positions[..], &later];
    let builds = Builds::new(
        &[moving(keys, &mesh.indices)],
        &[placed(0, DAffine3::IDENTITY)],
    );
    let at = |time| {
        let ray = Ray::new(Vec3::new(0.1, 0.2, 5.0), Vec3::NEG_Z);
        builds.intersect(&Ray { time, ..ray })
    };
    assert!(at(0.0).is_some());
    assert_eq!(at(-3.0), at(0.0));
    assert_eq!(at(0.5), None);
    assert_eq!(at(7.0), None);
    assert_eq!(at(f32::NAN), None);
}
