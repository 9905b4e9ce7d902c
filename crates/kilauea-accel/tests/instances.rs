//! Placed geometry against the same geometry baked by hand.

mod shapes;

use kilauea_accel::{Geometry, Hit, Placement, Ray};
use kilauea_math::{DAffine3, DMat3, DVec3, Vec3};
use shapes::{Builds, Mesh, Random, bumpy_sphere, grid, placed, soup};

fn baked(mesh: &Mesh, placement: &Placement) -> Mesh {
    let mut mesh = mesh.clone();
    for p in &mut mesh.positions {
        let p_geometry = Vec3::from_array(*p).as_dvec3();
        let p_world = placement.world_from_geometry.transform_point3(p_geometry);
        *p = p_world.as_vec3().to_array();
    }
    mesh
}

/// Transforms that move `f32` positions of a small mesh to `f32` positions without rounding.
fn exact_transforms() -> [DAffine3; 4] {
    let turned = DMat3::from_cols(DVec3::Y, DVec3::NEG_X, DVec3::Z);
    let mirrored = DMat3::from_diagonal(DVec3::new(-1.0, 0.5, 2.0));
    [
        DAffine3::IDENTITY,
        DAffine3::from_mat3_translation(turned, DVec3::new(2.0, 0.0, -1.0)),
        DAffine3::from_mat3_translation(mirrored, DVec3::new(-2.0, 1.0, 0.0)),
        DAffine3::from_scale(DVec3::splat(-4.0)),
    ]
}

fn rays(n: usize, reach: f32) -> impl Iterator<Item = Ray> {
    let mut random = Random(5);
    (0..n).map(move |_| Ray::new(reach * random.point(), random.point()))
}

/// Positions on a grid of 2^-10, so that exact transforms exist.
fn on_grid(mut mesh: Mesh) -> Mesh {
    for x in mesh.positions.iter_mut().flatten() {
        *x = (*x * 1024.0).round() / 1024.0;
    }
    mesh
}

#[test]
fn instances_equal_baked_geometry() {
    let meshes = [on_grid(soup(200, 0.3, 1)), on_grid(bumpy_sphere(8))];
    let placements: Vec<Placement> = exact_transforms()
        .into_iter()
        .enumerate()
        .flat_map(|(i, transform)| [placed(0, transform), placed(i as u32 % 2, transform)])
        .collect();
    let geometries = meshes.each_ref().map(Mesh::geometry);
    let instanced = Builds::new(&geometries, &placements);
    let by_hand: Vec<Mesh> = placements
        .iter()
        .map(|placement| baked(&meshes[placement.geometry as usize], placement))
        .collect();
    let by_hand: Vec<Geometry<'_>> = by_hand.iter().map(Mesh::geometry).collect();
    let identities: Vec<Placement> = (0..by_hand.len() as u32)
        .map(|i| placed(i, DAffine3::IDENTITY))
        .collect();
    let flat = Builds::new(&by_hand, &identities);

    let mut n_hits = 0;
    for ray in rays(4000, 3.0) {
        let (a, b) = (instanced.intersect(&ray), flat.intersect(&ray));
        let same_place = |a: Hit, b: Hit| {
            (a.t - b.t).abs() <= 1e-6 * a.t
                && (a.u - b.u).abs().max((a.v - b.v).abs()) < 1e-5
                && (a.instance, a.primitive) == (b.instance, b.primitive)
        };
        assert_eq!(a.is_some(), b.is_some(), "{ray:?}");
        if let (Some(a), Some(b)) = (a, b) {
            assert!(same_place(a, b), "{ray:?}: {a:?} against {b:?}");
            n_hits += 1;
        }
    }
    assert!(n_hits > 1000, "{n_hits}");
}

#[test]
fn equal_instances_go_to_the_first() {
    let mesh = bumpy_sphere(6);
    let shift = DAffine3::from_translation(DVec3::new(5.0, 0.0, 0.0));
    let placements = [shift, DAffine3::IDENTITY, DAffine3::IDENTITY, shift].map(|t| placed(0, t));
    let builds = Builds::new(&[mesh.geometry()], &placements);
    for ray in rays(500, 0.5) {
        assert_eq!(
            builds.intersect(&ray).map(|hit| hit.instance),
            Some(1),
            "{ray:?}"
        );
    }
}

#[test]
fn small_instances_far_away_do_not_leak() {
    let mesh = bumpy_sphere(10);
    let places = [DVec3::new(3e6, 1e6, -2e6), DVec3::new(-1e6, 1e5, 4e6)];
    let placements = places.map(|center| placed(0, DAffine3::from_translation(center)));
    let builds = Builds::new(&[mesh.geometry()], &placements);
    let mut random = Random(2);
    for i in 0..2000 {
        // Engine space has a quarter of a unit here, which shifts the line by a fraction of it.
        let center = places[i % 2];
        let corner = mesh.positions[random.index(mesh.positions.len())].map(f64::from);
        let target = center + 0.5 * DVec3::from_array(corner);
        let origin = 3.0 * random.point();
        let dir = (target - origin.as_dvec3()).as_vec3();
        let hit = builds.intersect(&Ray::new(origin, dir));
        assert_eq!(
            hit.map(|hit| hit.instance),
            Some(i as u32 % 2),
            "{origin} to {target}"
        );
    }
}

#[test]
fn closed_instances_hold_rays_in() {
    let mesh = bumpy_sphere(12);
    let turn = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7);
    let placements = [2.0, -0.01].map(|scale| {
        placed(
            0,
            DAffine3::from_mat3_translation(turn * scale, DVec3::new(40.0, 1.0, 7.0)),
        )
    });
    let builds = Builds::new(&[mesh.geometry()], &placements);
    let outer = baked(&mesh, &placements[0]);
    let mut random = Random(8);
    for i in 0..3000 {
        let [a, b, _] = outer.corners(random.index(outer.indices.len()) as u32);
        let target = if i % 2 == 0 {
            a
        } else {
            a + random.unit() * (b - a)
        };
        let origin = Vec3::new(40.0, 1.0, 7.0) + 0.5 * random.point();
        assert!(
            builds
                .intersect(&Ray::new(origin, target - origin))
                .is_some()
        );
    }
}

#[test]
fn one_placement_reports_instance_zero_and_a_far_one_keeps_its_shape() {
    let mesh = bumpy_sphere(8);
    for center in [
        DVec3::ZERO,
        DVec3::new(10.0, 0.0, 0.0),
        DVec3::new(1e6, 0.0, 0.0),
    ] {
        let place = placed(0, DAffine3::from_translation(center));
        let builds = Builds::new(&[mesh.geometry()], &[place]);
        let hit = builds
            .intersect(&Ray::new(center.as_vec3(), Vec3::NEG_Z))
            .unwrap();
        assert_eq!((hit.t, hit.instance), (1.0, 0));
    }
}

/// Ends of a rod of length 512 from `near_end` on, each a grid so that trees box it tightly.
fn rod_ends(near_end: f32, width: f32) -> Mesh {
    let mut rod = Mesh::default();
    for end in [near_end, near_end + 512.0] {
        let (first, cap) = (rod.positions.len() as u32, grid(8));
        let place = |p: &[f32; 3]| [end, p[0] * width / 8.0, p[1] * width / 8.0];
        rod.positions.extend(cap.positions.iter().map(place));
        let triangles = cap.indices.iter().map(|t| t.map(|i| first + i));
        rod.indices.extend(triangles);
    }
    rod
}

/// A ball around a rod touches its ends: where rays start must not be rounded past them.
#[test]
fn rays_along_rods_meet_their_ends() {
    let mut random = Random(9);
    for (near_end, width, distance) in [(1e5, 1.0, 1e3), (0.0, 1e-3, 1e9), (-512.0, 1e-3, 1e9)] {
        let rod = rod_ends(near_end, width);
        let aside = [1.0, -1.0].map(|y| placed(0, DAffine3::from_translation(DVec3::Y * y)));
        let builds = Builds::new(&[rod.geometry()], &aside);
        for _ in 0..100 {
            let beside = Vec3::new(0.0, 1.0 + width * random.unit(), width * random.unit());
            for (end, side) in [(near_end, -1.0), (near_end + 512.0, 1.0)] {
                let origin = beside + Vec3::X * (end + side * distance);
                let dir = Vec3::X * (-side * (1.0 + random.unit()));
                let hit = builds.intersect(&Ray::new(origin, dir)).expect("an end");
                let t = (end - origin.x) / dir.x;
                assert!(
                    (hit.t - t).abs() <= t * f32::EPSILON,
                    "{near_end}: {hit:?} {t}"
                );
            }
        }
    }
}
