//! Nothing that comes in makes a build or a walk fail.

mod shapes;

use kilauea_accel::{Accel, BuildOptions, Geometry, Ray};
use kilauea_math::{DAffine3, DMat3, DVec3, Vec3};
use shapes::{Builds, Mesh, Random, bumpy_sphere, placed, soup};

#[test]
fn nothing_is_hit_in_nothing() {
    for builds in [
        Builds::new(&[], &[]),
        Builds::new(&[], &[placed(0, DAffine3::IDENTITY)]),
        Builds::new(&[Geometry::default()], &[placed(0, DAffine3::IDENTITY)]),
        Builds::new(
            &[Geometry::default()],
            &[0; 3].map(|_| placed(0, DAffine3::IDENTITY)),
        ),
        Builds::new(&[soup(9, 1.0, 0).geometry()], &[]),
    ] {
        assert_eq!(builds.intersect(&Ray::new(Vec3::ZERO, Vec3::X)), None);
        assert!(builds.0[0].bounds().is_empty());
    }
}

#[test]
fn invalid_triangles_are_counted_and_keep_their_number() {
    let mut mesh = Mesh::default();
    mesh.add([Vec3::NAN, Vec3::X, Vec3::Y]);
    mesh.add([Vec3::ZERO, Vec3::X, Vec3::INFINITY]);
    mesh.add([Vec3::ZERO, Vec3::X, 2.0 * Vec3::X]);
    mesh.add([Vec3::ONE; 3]);
    mesh.add([Vec3::ZERO, Vec3::X, Vec3::new(0.0, 1e30, 0.0)]);
    mesh.indices.push([0, 1, 999]);
    mesh.add([Vec3::ZERO, Vec3::X, Vec3::Y]);
    let second = soup(3, 1e-3, 0).moved(Vec3::splat(9.0));
    let geometry = Geometry {
        meshes: vec![
            kilauea_accel::Mesh::still(&second.positions, &second.indices),
            kilauea_accel::Mesh::still(&mesh.positions, &mesh.indices),
        ],
        ..Geometry::default()
    };
    let builds = Builds::new(&[geometry], &[placed(0, DAffine3::IDENTITY)]);
    assert!(builds.0.iter().all(|accel| accel.n_rejected() == 6));
    let hit = builds.intersect(&Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z));
    assert_eq!(hit.map(|hit| hit.primitive), Some(9));
}

#[test]
fn invalid_placements_are_counted() {
    let mesh = bumpy_sphere(4);
    let flat = DMat3::from_diagonal(DVec3::new(1.0, 0.0, 1.0));
    let placements = [
        placed(0, DAffine3::from_mat3(flat)),
        placed(7, DAffine3::IDENTITY),
        placed(0, DAffine3::from_translation(DVec3::NAN)),
        placed(0, DAffine3::IDENTITY),
        placed(0, DAffine3::from_translation(DVec3::new(1e300, 0.0, 0.0))),
        placed(0, DAffine3::from_translation(DVec3::X)),
    ];
    let builds = Builds::new(&[mesh.geometry()], &placements);
    assert_eq!(builds.0[0].n_rejected(), 4);
    let hit = builds.intersect(&Ray::new(Vec3::ZERO, Vec3::NEG_X));
    assert!(hit.is_some_and(|hit| hit.instance == 5 || hit.instance == 3));
}

#[test]
fn invalid_rays_hit_nothing() {
    let builds = Builds::of(&bumpy_sphere(4));
    let good = Ray::new(Vec3::ZERO, Vec3::Z);
    assert!(builds.intersect(&good).is_some());
    for bad in [
        Ray {
            origin: Vec3::new(0.0, f32::NAN, 0.0),
            ..good
        },
        Ray {
            origin: Vec3::INFINITY,
            ..good
        },
        Ray {
            dir: Vec3::new(0.0, f32::NAN, 1.0),
            ..good
        },
        Ray {
            dir: Vec3::new(0.0, f32::INFINITY, 1.0),
            ..good
        },
        Ray {
            dir: Vec3::ZERO,
            ..good
        },
        Ray {
            t_min: f32::NAN,
            ..good
        },
        Ray {
            t_max: f32::NAN,
            ..good
        },
        Ray {
            t_min: 0.5,
            t_max: 0.5,
            ..good
        },
        Ray {
            t_max: -1.0,
            ..good
        },
    ] {
        assert_eq!(builds.intersect(&bad), None, "{bad:?}");
    }
}

#[test]
fn any_length_of_direction_works() {
    let builds = Builds::of(&bumpy_sphere(12));
    let unit = Vec3::new(0.48, 0.6, 0.64);
    let t_unit = builds.intersect(&Ray::new(Vec3::ZERO, unit)).unwrap().t;
    for exponent in (-36..=36).step_by(4) {
        let length = 10_f32.powi(exponent);
        let ray = Ray::new(Vec3::ZERO, unit * length);
        let t = builds.intersect(&ray).unwrap().t;
        assert!((t * length / t_unit - 1.0).abs() < 1e-5, "{length}: {t}");
        let t_range = |t_min, t_max| Ray {
            t_min,
            t_max,
            ..ray
        };
        assert!(
            builds.intersect(&t_range(1.001 * t, f32::MAX)).is_none(),
            "{length}"
        );
        assert!(
            builds.intersect(&t_range(0.0, 0.999 * t)).is_none(),
            "{length}"
        );
        assert!(
            builds.0[0]
                .intersect_filtered(&ray, |hit| hit.t < 0.999 * t)
                .is_none()
        );
    }
}

#[test]
fn an_origin_at_any_distance_works() {
    let mut mesh = Mesh::default();
    mesh.add([Vec3::ZERO, Vec3::X, Vec3::Y]);
    let builds = Builds::of(&mesh);
    for exponent in (0..=32).step_by(4) {
        let distance = 10_f32.powi(exponent);
        let toward = Ray::new(Vec3::new(0.25, 0.25, distance), Vec3::NEG_Z);
        let hit = builds.intersect(&toward).unwrap();
        assert_eq!((hit.t, hit.u, hit.v), (distance, 0.25, 0.25));
        let beside = Ray::new(Vec3::new(0.75, 0.75, distance), Vec3::NEG_Z);
        assert_eq!(builds.intersect(&beside), None);
        let away = Ray::new(toward.origin, Vec3::Z);
        assert_eq!(builds.intersect(&away), None);
    }
}

#[test]
fn ends_of_the_range_are_half_open() {
    let mut mesh = Mesh::default();
    mesh.add([Vec3::ZERO, Vec3::X, Vec3::Y]);
    let builds = Builds::of(&mesh);
    let ray = Ray::new(Vec3::new(0.25, 0.25, 2.0), Vec3::NEG_Z);
    assert!(builds.intersect(&Ray { t_max: 2.0, ..ray }).is_some());
    assert!(builds.intersect(&Ray { t_min: 2.0, ..ray }).is_none());
    assert!(
        builds
            .intersect(&Ray::new(ray.origin.with_z(0.0), Vec3::NEG_Z))
            .is_none()
    );
}

#[test]
fn filters_choose_among_all_hits() {
    let mesh = soup(300, 1.0, 4);
    let builds = Builds::of(&mesh);
    let mut random = Random(1);
    for _ in 0..300 {
        let ray = Ray::new(1.5 * random.point(), random.point());
        // Walking on from hit to hit finds what a filter finds at once.
        let keep = |triangle: u32| triangle % 7 == 3;
        let mut expected = builds.intersect(&ray);
        while let Some(hit) = expected
            && !keep(hit.primitive)
        {
            expected = builds.intersect(&Ray {
                t_min: hit.t,
                ..ray
            });
        }
        for accel in &builds.0 {
            let found = accel.intersect_filtered(&ray, |hit| keep(hit.primitive));
            assert_eq!(found, expected, "{ray:?}");
            let occluded = accel.occluded_filtered(&ray, |hit| keep(hit.primitive));
            assert_eq!(occluded, expected.is_some(), "{ray:?}");
        }
    }
}

#[test]
fn wild_numbers_do_not_panic() {
    const WILD: [f32; 12] = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        1e-40,
        1e-20,
        1e12,
        -1e13,
        1e30,
        f32::MAX,
        f32::INFINITY,
        f32::NAN,
    ];
    let mut random = Random(6);
    let mut wild = |tame: f32| {
        let i = random.index(3 * WILD.len());
        WILD.get(i).copied().unwrap_or(tame * random.point().x)
    };
    for n in 0..60 {
        let mut mesh = soup(n * n / 4, 1.0, n as u32);
        for x in mesh.positions.iter_mut().flatten() {
            *x = wild(*x);
        }
        let transform = DMat3::from_diagonal(DVec3::from_array([1.0; 3].map(|x| wild(x).into())));
        let place = [transform, DMat3::IDENTITY].map(|m| placed(0, DAffine3::from_mat3(m)));
        let n_placed = 1 + n % 2;
        for simd in [false, true] {
            let options = BuildOptions {
                simd,
                ..BuildOptions::default()
            };
            let accel = Accel::build(&[mesh.geometry()], &place[2 - n_placed..], &options);
            accel.validate().unwrap();
        }
        let builds = Builds::new(&[mesh.geometry()], &place[2 - n_placed..]);
        for _ in 0..50 {
            let ray = Ray {
                origin: Vec3::new(wild(1.0), wild(1.0), wild(1.0)),
                dir: Vec3::new(wild(1.0), wild(1.0), wild(1.0)),
                t_min: wild(1.0),
                t_max: wild(9.0),
                ..Ray::new(Vec3::ZERO, Vec3::X)
            };
            for accel in &builds.0 {
                let hit = accel.intersect(&ray);
                assert!(hit.is_none_or(|hit| hit.t > ray.t_min.max(0.0) && hit.t <= ray.t_max));
                assert!(hit.is_none_or(|hit| (0.0..=1.0).contains(&hit.u)));
                accel.occluded(&ray);
            }
            for pair in builds.0.chunks(3) {
                assert_eq!(pair[0].intersect(&ray), pair[1].intersect(&ray), "{ray:?}");
                assert_eq!(pair[0].intersect(&ray), pair[2].intersect(&ray), "{ray:?}");
            }
        }
    }
}

#[test]
fn wild_indices_and_matrices_do_not_panic() {
    const WILD: [f64; 12] = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        1e-320,
        1e-150,
        1e-30,
        1e30,
        -1e150,
        1e308,
        f64::INFINITY,
        f64::NAN,
    ];
    let mut random = Random(12);
    for n in 0..60 {
        let mut mesh = soup(20, 1.0, n);
        for i in mesh.indices.iter_mut().flatten() {
            *i = [u32::MAX, 1 << 31, 60, 59]
                .get(random.index(40))
                .copied()
                .unwrap_or(*i);
        }
        let mut wild = |tame: f64| {
            let i = random.index(4 * WILD.len());
            WILD.get(i).copied().unwrap_or(tame)
        };
        let mut wild3 = |p: DVec3| DVec3::new(wild(p.x), wild(p.y), wild(p.z));
        let placements = [0, 0, 7, 0].map(|geometry| {
            let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(&mut wild3);
            let matrix = DMat3::from_cols(axes[0], axes[1], axes[2]);
            placed(
                geometry,
                DAffine3::from_mat3_translation(matrix, wild3(DVec3::ONE)),
            )
        });
        let builds = Builds::new(&[mesh.geometry()], &placements);
        assert!(builds.0[0].n_rejected() >= 1);
        for seed in 0..50 {
            let mut random = Random(seed << 8);
            let ray = Ray::new(3.0 * random.point(), random.point());
            for builds in builds.0.chunks(3) {
                let hit = builds[0].intersect(&ray);
                let agree = builds.iter().all(|accel| accel.intersect(&ray) == hit);
                assert!(agree, "{ray:?} {placements:?}");
            }
        }
    }
}
