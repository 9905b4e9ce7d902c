//! Spheres, curves and motion that cannot be traced are left out and counted.

mod shapes;

use kilauea_accel::{
    CurveBasis, CurveProfile, Curves, Geometry, Mesh, Placement, Ray, Spheres, Visibility,
};
use kilauea_math::{DAffine3, DVec3, Vec3};
use shapes::{Builds, Random, placed, soup};

const FAR: [f32; 3] = [1e30, 0.0, 0.0];
const NAN: [f32; 3] = [f32::NAN, 0.0, 0.0];

fn check(geometry: Geometry<'_>, n_rejected: usize) -> Builds {
    let builds = Builds::new(&[geometry], &[placed(0, DAffine3::IDENTITY)]);
    for accel in &builds.0 {
        assert_eq!(accel.n_rejected(), n_rejected);
    }
    builds
}

#[test]
fn bad_spheres_are_counted_and_keep_their_number() {
    let centers = [
        [0.0; 3],
        NAN,
        FAR,
        [1.0; 3],
        [2.0; 3],
        [3.0; 3],
        [0.0, 0.0, 9.0],
    ];
    let radii = [0.0, 1.0, 1.0, -1.0, f32::INFINITY, f32::NAN, 0.5, 1.0];
    let spheres = Spheres {
        centers: vec![&centers],
        radii: &radii,
        visibility: Visibility::ALL,
    };
    let no_keys = Spheres {
        centers: Vec::new(),
        ..spheres.clone()
    };
    let geometry = Geometry {
        spheres: vec![spheres, no_keys],
        ..Geometry::default()
    };
    let builds = check(geometry, 7 + 8);
    let hit = builds.intersect(&Ray::new(Vec3::ZERO, Vec3::Z));
    assert_eq!(hit.map(|hit| (hit.t, hit.primitive)), Some((8.5, 6)));
}

#[test]
fn bad_segments_are_counted_and_keep_their_number() {
    let line = |z: f32| [-1.0, -0.3, 0.3, 1.0].map(|x| [x, 0.0, z]);
    let points = [
        line(1.0),
        [NAN; 4],
        [FAR; 4],
        line(2.0),
        line(3.0),
        line(4.0),
    ]
    .concat();
    let mut radii = vec![0.1; 22];
    radii[13] = -0.1;
    radii[16..20].fill(0.0);
    let segments = [0, 4, 8, 12, 16, 20, 21, u32::MAX, 1];
    for (profile, basis, n_rejected) in [
        // The segments at 1 crosses into what is not a number.
        (CurveProfile::Round, CurveBasis::Bezier, 8),
        (CurveProfile::Ribbon, CurveBasis::Bezier, 8),
        (CurveProfile::Round, CurveBasis::Linear, 6),
        (CurveProfile::Ribbon, CurveBasis::Linear, 6),
    ] {
        let curves = Curves {
            points: vec![&points],
            radii: &radii,
            normals: None,
            segments: &segments,
            basis,
            profile,
            visibility: Visibility::ALL,
        };
        let geometry = Geometry {
            curves: vec![curves],
            ..Geometry::default()
        };
        let builds = check(geometry, n_rejected);
        let hit = builds.intersect(&Ray::new(Vec3::new(-0.9, 0.0, 0.0), Vec3::Z));
        assert_eq!(
            hit.map(|hit| hit.primitive),
            Some(0),
            "{profile:?} {basis:?}"
        );
    }
}

#[test]
fn bad_normals_and_keys_are_counted() {
    let points = [-1.0, -0.3, 0.3, 1.0].map(|x| [x, 0.0, 1.0]);
    let short = &points[..3];
    let radii = [0.1; 4];
    let normals = [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], NAN, [0.0; 3]];
    let curves = Curves {
        points: vec![&points],
        radii: &radii,
        normals: Some(&normals),
        segments: &[0],
        basis: CurveBasis::Bezier,
        profile: CurveProfile::Ribbon,
        visibility: Visibility::ALL,
    };
    let variants = [
        curves.clone(),
        Curves {
            normals: Some(&normals[..2]),
            ..curves.clone()
        },
        Curves {
            points: vec![&points, short],
            normals: None,
            ..curves.clone()
        },
        Curves {
            points: Vec::new(),
            normals: None,
            ..curves
        },
    ];
    for variant in variants {
        let geometry = Geometry {
            curves: vec![variant],
            ..Geometry::default()
        };
        check(geometry, 1);
    }
}

#[test]
fn bad_moving_triangles_are_counted() {
    let mesh = soup(5, 1.0, 3);
    let mut later = mesh.positions.clone();
    later[0] = NAN;
    later[4] = FAR;
    let still = Mesh::still(&mesh.positions, &mesh.indices);
    let moving = Mesh {
        positions: vec![&mesh.positions, &later],
        ..still.clone()
    };
    let cut_short = Mesh {
        positions: vec![&mesh.positions, &later[6..9]],
        ..still
    };
    for (mesh, n_rejected) in [(moving, 2), (cut_short, 4)] {
        let geometry = Geometry {
            meshes: vec![mesh],
            ..Geometry::default()
        };
        check(geometry, n_rejected);
    }
}

/// A placement that is flat for a moment is not hit then, and one that is flat at a key never.
#[test]
fn placements_without_an_inverse() {
    let mesh = soup(30, 1.0, 4);
    let moving = |keys: Vec<DAffine3>| Placement {
        motion: Some(keys.into()),
        ..placed(0, DAffine3::IDENTITY)
    };
    let flipped = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let flat = DAffine3::from_scale(DVec3::new(0.0, 1.0, 1.0));
    let turning = Builds::new(
        &[mesh.geometry()],
        &[moving(vec![DAffine3::IDENTITY, flipped])],
    );
    let never = Builds::new(&[mesh.geometry()], &[moving(vec![flat, flipped])]);
    assert!(never.0.iter().all(|accel| accel.n_rejected() == 1));
    let mut random = Random(5);
    let mut n_hits = 0;
    for _ in 0..300 {
        let ray = Ray::new(2.0 * random.point(), random.point());
        let at = |time| turning.intersect(&Ray { time, ..ray });
        n_hits += usize::from(at(0.0).is_some()) + usize::from(at(0.9).is_some());
        assert_eq!(at(0.5), None);
        assert_eq!(never.intersect(&ray), None);
    }
    assert!(n_hits > 50, "{n_hits}");
}

/// Nothing is visible to no rays, and that is no fault of the input.
#[test]
fn what_no_ray_sees_is_no_reject() {
    let mesh = soup(9, 1.0, 6);
    let hidden = Mesh {
        visibility: Visibility::NONE,
        ..Mesh::still(&mesh.positions, &mesh.indices)
    };
    let geometry = Geometry {
        meshes: vec![hidden],
        ..Geometry::default()
    };
    assert!(check(geometry, 0).0[0].bounds().is_empty());
}
