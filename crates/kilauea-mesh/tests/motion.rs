//! Motion keys and ray visibility through `assemble`.

mod stage;

use kilauea_math::{DAffine3, DVec3, Vec3};
use kilauea_mesh::*;
use kilauea_scene::Visibility;
use stage::*;

fn moved(points: &[[f32; 3]], by: f32) -> Vec<[f32; 3]> {
    points.iter().map(|p| [p[0] + by, p[1], p[2]]).collect()
}

#[test]
fn what_stands_still_has_no_keys() {
    let assembled = assemble_one(cube(), &AssembleOptions::default());
    assert!(only_chunk(&assembled).0.later_keys.is_empty());
}

#[test]
fn polygons_follow_their_points() {
    let later = [moved(&CUBE_POINTS, 2.0), moved(&CUBE_POINTS, 6.0)];
    let mut mesh = cube();
    mesh.prototype_from_mesh = DAffine3::from_scale(DVec3::splat(3.0));
    mesh.later_keys = later
        .iter()
        .map(|points| MeshPose {
            points,
            normals: None,
        })
        .collect();
    let assembled = assemble_one(mesh, &AssembleOptions::default());
    let (chunk, _) = only_chunk(&assembled);
    // The middle of all that is passed through: x from -3 to 21.
    assert_eq!(
        assembled.scene.prototypes[0].center,
        DVec3::new(9.0, 0.0, 0.0)
    );
    for (key, by) in chunk.later_keys.iter().zip([6.0, 18.0]) {
        for (p, q) in chunk.positions.iter().zip(&key.positions) {
            let step = Vec3::from_array(*q) - Vec3::from_array(*p);
            assert!(step.distance(Vec3::X * by) < 1e-5, "{step}");
        }
        assert_eq!(key.normals, None);
    }
}

#[test]
fn normals_turn_with_their_keys() {
    let (up, along) = ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let mut mesh = cube();
    mesh.normals = Some(primvar("constant", 3, &up));
    mesh.later_keys = vec![MeshPose {
        points: &CUBE_POINTS,
        normals: Some(primvar("constant", 3, &along)),
    }];
    let assembled = assemble_one(mesh, &AssembleOptions::default());
    let (chunk, _) = only_chunk(&assembled);
    assert!(normals(chunk).iter().all(|n| *n == up));
    let later = chunk.later_keys[0].normals.as_deref();
    assert!(later.is_some_and(|later| later.iter().all(|n| *n == along)));
}

#[test]
fn every_key_of_a_cage_is_a_limit_surface() {
    let wide: Vec<[f32; 3]> = CUBE_POINTS.iter().map(|p| p.map(|x| 2.0 * x)).collect();
    let mut mesh = cube();
    mesh.subdivision = Some(subdivision(Scheme::CatmullClark));
    mesh.later_keys = vec![MeshPose {
        points: &wide,
        normals: None,
    }];
    let assembled = assemble_one(mesh, &options(2));
    let (chunk, _) = only_chunk(&assembled);
    let [key] = &chunk.later_keys[..] else {
        panic!("one later key");
    };
    assert_eq!(key.positions.len(), chunk.positions.len());
    for (p, q) in chunk.positions.iter().zip(&key.positions) {
        let [p, q] = [p, q].map(|p| Vec3::from_array(*p));
        assert!(q.distance(2.0 * p) < 1e-5, "{p} {q}");
    }
    // Uniform scale keeps the normals.
    let later = key.normals.as_ref().expect("a smooth surface");
    for (n, m) in normals(chunk).iter().zip(later) {
        assert!(Vec3::from_array(*n).distance(Vec3::from_array(*m)) < 1e-4);
    }
}

#[test]
fn keys_that_do_not_fit_are_reported_and_left_out() {
    let mut broken = CUBE_POINTS;
    broken[2][1] = f32::INFINITY;
    for (points, expected) in [
        (&CUBE_POINTS[..7], "/mesh: points: their number changes"),
        (
            &broken[..],
            "/mesh: points: not finite at a later motion key",
        ),
    ] {
        let mut mesh = cube();
        mesh.later_keys = vec![MeshPose {
            points,
            normals: None,
        }];
        let assembled = assemble_one(mesh, &AssembleOptions::default());
        assert!(
            assembled.warnings[0].starts_with(expected),
            "{:?}",
            assembled.warnings
        );
        let (chunk, _) = only_chunk(&assembled);
        assert_eq!((chunk.triangles.len(), chunk.later_keys.len()), (12, 0));
    }
}

#[test]
fn rays_that_see_an_instance_are_those_that_see_its_contents() {
    let mut payloads = empty();
    payloads.prototypes.push("/a".into());
    let mut mesh = cube();
    mesh.prototype = 1;
    mesh.visibility = Visibility::CAMERA | Visibility::SHADOW;
    payloads.meshes.push(mesh);
    payloads.instances.push(InstancesPayload {
        path: "/instancer",
        parent: 0,
        prototype: 1,
        parent_from_prototype: vec![shift(1.0)],
        later_parent_from_prototype: Vec::new(),
        primvars: Vec::new(),
        visibility: Visibility::SHADOW | Visibility::INDIRECT,
    });
    let assembled = assemble(payloads, &AssembleOptions::default()).unwrap();
    assert_eq!(only_chunk(&assembled).0.visibility, Visibility::SHADOW);
}
