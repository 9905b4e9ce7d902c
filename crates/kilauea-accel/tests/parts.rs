//! Scenes cut into parts: the front-most hit of all parts is that of the whole, bit for bit.

mod mixed_scene;
mod shapes;

use kilauea_accel::{
    Accel, BoxTree, BuildOptions, Curves, Geometry, Hit, Mesh, Ray, Spheres, Visibility, Whole,
};
use kilauea_math::{Bounds3, DAffine3, DVec3, Vec3};
use mixed_scene::{Group, MixedScene};
use shapes::Random;

/// A geometry of which a part keeps every `n_parts`-th mesh and group.
fn cut<'a>(geometry: &Geometry<'a>, part: usize, n_parts: usize) -> Geometry<'a> {
    let n_meshes = geometry.meshes.len();
    let n_spheres = geometry.spheres.len();
    let is_here = |i: usize| i % n_parts == part;
    let meshes = geometry.meshes.iter().enumerate();
    let spheres = geometry.spheres.iter().enumerate();
    let curves = geometry.curves.iter().enumerate();
    Geometry {
        meshes: meshes
            .map(|(i, mesh)| {
                if is_here(i) {
                    mesh.clone()
                } else {
                    Mesh::still(&[], &[])
                }
            })
            .collect(),
        spheres: spheres
            .map(|(i, group)| Spheres {
                radii: if is_here(n_meshes + i) {
                    group.radii
                } else {
                    &[]
                },
                ..group.clone()
            })
            .collect(),
        curves: curves
            .map(|(i, group)| Curves {
                segments: if is_here(n_meshes + n_spheres + i) {
                    group.segments
                } else {
                    &[]
                },
                ..group.clone()
            })
            .collect(),
    }
}

fn front_most(parts: &[Accel], ray: &Ray) -> Option<Hit> {
    let hits = parts.iter().filter_map(|part| part.intersect(ray));
    hits.reduce(|a, b| if b.wins_over(&a) { b } else { a })
}

fn check(scene: &MixedScene, seed: u32) {
    let geometries = scene.geometries();
    let options = BuildOptions::default();
    let undivided = Accel::build(&geometries, &scene.placements, &options);
    let whole = Whole::of(&geometries, &scene.placements);
    for n_parts in [2, 9] {
        let parts: Vec<Accel> = (0..n_parts)
            .map(|part| {
                let cut = geometries.iter().map(|g| cut(g, part, n_parts));
                let cut: Vec<_> = cut.collect();
                Accel::build_part(&cut, &scene.placements, &whole, &options)
            })
            .collect();
        let mut random = Random(seed);
        let mut n_hits = 0;
        for _ in 0..500 {
            let origin = 3.0 * random.point();
            let kinds = [Visibility::CAMERA, Visibility::SHADOW, Visibility::ALL];
            let ray = Ray {
                time: random.unit(),
                visibility: kinds[random.index(3)],
                ..Ray::new(origin, random.point() - origin)
            };
            let hit = undivided.intersect(&ray);
            assert_eq!(front_most(&parts, &ray), hit, "{n_parts} parts, {ray:?}");
            let is_occluded = parts.iter().any(|part| part.occluded(&ray));
            assert_eq!(is_occluded, undivided.occluded(&ray), "{ray:?}");
            n_hits += usize::from(hit.is_some());
        }
        assert!(n_hits > 150, "{n_hits} hits");
    }
}

#[test]
fn parts_hit_what_the_whole_hits() {
    check(&MixedScene::new(&Group::ALL, 1, 3), 1);
    check(&MixedScene::new(&Group::ALL, 3, 4), 2);
}

#[test]
fn parts_of_instances_hit_what_the_whole_hits() {
    let mut scene = MixedScene::new(&Group::ALL, 1, 5);
    scene.place_several(None);
    check(&scene, 3);
    let mut scene = MixedScene::new(&Group::ALL, 2, 6);
    let turned = DAffine3::from_rotation_z(0.7) * DAffine3::from_translation(DVec3::X);
    scene.place_several(Some(turned));
    scene.mask();
    check(&scene, 4);
}

/// What the whole rounds in engine space, parts do too, even where they alone would not.
#[test]
fn parts_far_away_are_placed_like_the_whole() {
    let positions = [[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0], [0.0, 1e-3, 1e-4]];
    let far = [[0.0, 0.0, 0.0], [900.0, 0.0, 0.0], [0.0, 900.0, 0.0]];
    let triangles = [[0, 1, 2]];
    let small = Mesh::still(&positions, &triangles);
    let large = Mesh::still(&far, &triangles);
    let both = |small, large| Geometry {
        meshes: vec![small, large],
        ..Geometry::default()
    };
    let geometries = [both(small.clone(), large)];
    let away = DAffine3::from_translation(DVec3::new(12_345.678_9, 0.1, 0.2));
    let placements = [kilauea_accel::Placement::still(0, away)];
    let whole = Whole::of(&geometries, &placements);
    let undivided = Accel::build(&geometries, &placements, &BuildOptions::default());
    let part = [both(small, Mesh::still(&[], &[]))];
    let part = Accel::build_part(&part, &placements, &whole, &BuildOptions::default());
    let mut random = Random(7);
    let mut n_hits = 0;
    for _ in 0..200 {
        let origin = Vec3::new(12_345.68, 0.1, 1.0);
        let target = origin - Vec3::Z + 1e-3 * random.point();
        let ray = Ray::new(origin, target - origin);
        let Some(hit) = part.intersect(&ray) else {
            continue;
        };
        let of_whole = undivided.intersect(&ray).expect("the whole has it too");
        if of_whole.primitive == 0 {
            assert_eq!(of_whole, hit);
            n_hits += 1;
        }
    }
    assert!(n_hits > 5, "{n_hits}");
}

#[test]
fn boxes_that_a_ray_pierces() {
    let mut random = Random(11);
    let boxes: Vec<Bounds3> = (0..200)
        .map(|_| {
            let p = random.point();
            let to = 0.3 * random.point();
            Bounds3::from_points([p, p + to])
        })
        .collect();
    let tree = BoxTree::build(&boxes);
    let mut n_pierced = 0;
    for _ in 0..500 {
        let origin = 2.0 * random.point();
        let ray = Ray {
            t_max: 1.5,
            ..Ray::new(origin, random.point() - origin)
        };
        let mut pierced = vec![false; boxes.len()];
        let is_tested = tree.visit_pierced(&ray, |i| {
            pierced[i as usize] = true;
            false
        });
        assert!(is_tested);
        for (bounds, is_pierced) in boxes.iter().zip(pierced) {
            // Where the ray is within a slab of each axis, in `f64`.
            let (mut near, mut far) = (0.0_f64, 1.5_f64);
            for axis in 0..3 {
                let at = |x: f32| {
                    (f64::from(x) - f64::from(ray.origin[axis])) / f64::from(ray.dir[axis])
                };
                let (a, b) = (at(bounds.min[axis]), at(bounds.max[axis]));
                near = near.max(a.min(b));
                far = far.min(a.max(b));
            }
            if (near - far).abs() > 1e-4 {
                assert_eq!(is_pierced, near < far, "{bounds:?} {ray:?}");
            }
            n_pierced += usize::from(is_pierced);
        }
    }
    assert!(n_pierced > 500, "{n_pierced}");
    let mut n_visited = 0;
    let through_all = Ray::new(Vec3::splat(-2.0), Vec3::ONE);
    let _ = tree.visit_pierced(&through_all, |_| {
        n_visited += 1;
        true
    });
    assert_eq!(n_visited, 1, "the visit ends when told to");
    let none = Ray::new(Vec3::splat(f32::NAN), Vec3::ONE);
    assert!(!tree.visit_pierced(&none, |_| false));
}
