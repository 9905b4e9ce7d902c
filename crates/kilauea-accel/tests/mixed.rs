//! Scenes of every kind of primitive, still and moving, placed and masked, against a plain tracer
//! that tests everything by other means.

mod mixed_scene;
mod shapes;

use kilauea_accel::{Hit, Ray, Visibility};
use kilauea_math::{DAffine3, DVec3};
use mixed_scene::{Group, MixedScene};
use shapes::{Builds, Random};

/// Rays from all around and from the primitives, at random times, of random kinds.
fn random_ray(random: &mut Random) -> Ray {
    let origin = 3.0 * random.point();
    let kinds = [
        Visibility::CAMERA,
        Visibility::SHADOW,
        Visibility::INDIRECT,
        Visibility::ALL,
    ];
    Ray {
        time: random.unit(),
        visibility: kinds[random.index(4)],
        ..Ray::new(origin, random.point() - origin)
    }
}

/// The hit is on its primitive, and whatever the plain tracer finds is not clearly nearer.
fn check_hit(scene: &MixedScene, ray: &Ray, hit: Option<Hit>) {
    const SLACK: f64 = 1e-4;
    if let Some(hit) = hit {
        let off = scene.distance_to(ray, &hit);
        assert!(off < 1e-5, "{ray:?} {hit:?}: off by {off}");
        assert!(scene.is_visible(ray, &hit), "{ray:?} sees {hit:?}");
    }
    if let Some(t) = scene.nearest(ray, SLACK) {
        let t_hit = hit.map_or(f64::INFINITY, |hit| f64::from(hit.t));
        assert!(t_hit < t + SLACK, "{ray:?} {hit:?}: missed one at {t}");
    }
}

fn check(scene: &MixedScene, n_rays: usize, seed: u32) {
    let builds = Builds::new(&scene.geometries(), &scene.placements);
    let mut random = Random(seed);
    let mut hits_by_group = [0; Group::ALL.len()];
    for _ in 0..n_rays {
        let ray = random_ray(&mut random);
        let hit = builds.intersect(&ray);
        check_hit(scene, &ray, hit);
        if let Some(hit) = hit {
            hits_by_group[scene.group_of(&hit) as usize] += 1;
        }
    }
    for group in Group::ALL {
        let n = hits_by_group[group as usize];
        let is_there = scene.has(group);
        assert!(!is_there || n > n_rays / 200, "{n} hits on {group:?}");
    }
}

#[test]
fn every_kind_alone() {
    for group in Group::ALL {
        check(&MixedScene::new(&[group], 1, 7), 200, 1);
    }
}

#[test]
fn all_kinds_together() {
    check(&MixedScene::new(&Group::ALL, 1, 3), 800, 2);
}

#[test]
fn all_kinds_moving() {
    for n_keys in [2, 3] {
        check(&MixedScene::new(&Group::ALL, n_keys, 4), 500, 3);
    }
}

#[test]
fn instances_of_all_kinds() {
    let mut scene = MixedScene::new(&Group::ALL, 1, 5);
    scene.place_several(None);
    check(&scene, 600, 4);
}

#[test]
fn moving_instances_of_moving_primitives() {
    let mut scene = MixedScene::new(&Group::ALL, 2, 6);
    let turned = DAffine3::from_rotation_z(0.7) * DAffine3::from_translation(DVec3::X);
    scene.place_several(Some(turned));
    check(&scene, 600, 5);
}

#[test]
fn what_shares_no_kind_with_a_ray_is_not_hit() {
    let mut scene = MixedScene::new(&Group::ALL, 1, 8);
    scene.mask();
    check(&scene, 800, 6);
    let builds = Builds::new(&scene.geometries(), &scene.placements);
    let ray = random_ray(&mut Random(3));
    let of_no_kind = Ray {
        visibility: Visibility::NONE,
        ..ray
    };
    assert_eq!(builds.intersect(&of_no_kind), None);
}

/// A range that ends or begins at a hit contains it, or not, to the last bit.
#[test]
fn ranges_that_end_on_curves_and_spheres() {
    let scene = MixedScene::new(&Group::ALL, 2, 9);
    let builds = Builds::new(&scene.geometries(), &scene.placements);
    let mut random = Random(10);
    let mut n_hits = 0;
    for _ in 0..400 {
        let ray = random_ray(&mut random);
        let Some(hit) = builds.intersect(&ray) else {
            continue;
        };
        let up_to = |t_max| builds.intersect(&Ray { t_max, ..ray });
        assert_eq!(up_to(hit.t), Some(hit));
        assert_eq!(up_to(hit.t.next_down()), None);
        let from = |t_min| builds.intersect(&Ray { t_min, ..ray });
        assert_eq!(from(hit.t.next_down()), Some(hit));
        assert_ne!(from(hit.t), Some(hit));
        n_hits += 1;
    }
    assert!(n_hits > 100, "{n_hits}");
}
