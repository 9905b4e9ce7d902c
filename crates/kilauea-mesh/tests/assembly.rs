//! Whole scenes from payloads.

mod stage;

use kilauea_math::{DAffine3, DVec3, Vec3};
use kilauea_mesh::*;
use kilauea_scene::{Interpolation, MeshChunk, SceneError, Visibility};
use stage::*;

fn polygon_options() -> AssembleOptions {
    AssembleOptions::default()
}

/// Every triangle of a mesh around the origin looks away from it, and so do its normals.
fn check_outward(assembled: &Assembled) {
    let (chunk, points) = only_chunk(assembled);
    for (triangle, normal) in chunk.triangles.iter().zip(area_normals(chunk)) {
        assert!(normal.length() > 0.0);
        for &v in triangle {
            assert!(normal.dot(points[v as usize]) > 0.0);
            if let Some(normals) = &chunk.normals {
                let n = Vec3::from_array(normals[v as usize]);
                assert!((n.length() - 1.0).abs() < 1e-6);
                assert!(n.dot(normal) > 0.0);
            }
        }
    }
}

#[test]
fn polygons_without_normals_are_faceted_and_share_vertices() {
    let assembled = assemble_one(cube(), &polygon_options());
    let (chunk, points) = only_chunk(&assembled);
    assert!(chunk.normals.is_none());
    assert_eq!((points.len(), chunk.triangles.len()), (8, 12));
    assert_eq!(assembled.n_triangles, 12);
    check_outward(&assembled);
}

#[test]
fn mirroring_and_orientation_flip_winding_not_normals() {
    let normals: Vec<f32> = CUBE_POINTS.iter().flatten().map(|x| 3.0 * x).collect();
    let reversed: Vec<i32> = CUBE_INDICES
        .chunks(4)
        .flat_map(|q| [q[0], q[3], q[2], q[1]])
        .collect();
    for scale in [
        DVec3::ONE,
        DVec3::new(-1.0, 1.0, 1.0),
        DVec3::new(-2.0, -1.0, 5.0),
        DVec3::splat(-3.0),
    ] {
        for left_handed in [false, true] {
            let mut mesh = cube();
            mesh.left_handed = left_handed;
            if left_handed {
                mesh.face_vertex_indices = &reversed;
            }
            mesh.normals = Some(primvar("vertex", 3, &normals));
            mesh.prototype_from_mesh = DAffine3::from_scale(scale);
            check_outward(&assemble_one(mesh, &polygon_options()));
        }
    }
}

#[test]
fn normals_transform_by_the_inverse_transpose() {
    let points = [[0., 0., 0.], [1., 0., -1.], [0., 1., 0.]];
    let mut mesh = mesh(&points, &[3], &[0, 1, 2]);
    let normals = [1.0, 0.0, 1.0];
    mesh.normals = Some(primvar("constant", 3, &normals));
    mesh.prototype_from_mesh = DAffine3::from_scale(DVec3::new(4.0, 1.0, 1.0));
    let assembled = assemble_one(mesh, &polygon_options());
    let (chunk, _) = only_chunk(&assembled);
    let geometric = area_normals(chunk)[0].normalize();
    for n in chunk.normals.as_ref().unwrap() {
        assert!(Vec3::from_array(*n).distance(geometric) < 1e-6);
    }
}

#[test]
fn invalid_normals_become_geometric() {
    let points = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]];
    let mut mesh = mesh(&points, &[3], &[0, 1, 2]);
    let normals = [0.0, 0.0, 0.0, f32::NAN, 0.0, 1.0, 0.0, 1.0, 1.0];
    mesh.normals = Some(primvar("vertex", 3, &normals));
    let assembled = assemble_one(mesh, &polygon_options());
    let (chunk, _) = only_chunk(&assembled);
    let half = 0.5_f32.sqrt();
    for (n, expected) in
        chunk
            .normals
            .as_ref()
            .unwrap()
            .iter()
            .zip([Vec3::Z, Vec3::Z, Vec3::new(0.0, half, half)])
    {
        assert!(Vec3::from_array(*n).distance(expected) < 1e-6);
    }
}

#[test]
fn uniform_normals_split_vertices() {
    #[rustfmt::skip]
    let normals = [
        0., 0., -1., 0., 0., 1., 0., -1., 0., 0., 1., 0., -1., 0., 0., 1., 0., 0.,
    ];
    let mut mesh = cube();
    mesh.normals = Some(primvar("uniform", 3, &normals));
    let assembled = assemble_one(mesh, &polygon_options());
    check_outward(&assembled);
    assert_eq!(only_chunk(&assembled).0.positions.len(), 24);
}

#[test]
fn every_interpolation_reaches_its_triangles() {
    // Two quads, and a point that nothing uses.
    let points = [
        [9., 9., 9.],
        [0., 0., 0.],
        [1., 0., 0.],
        [2., 0., 0.],
        [0., 1., 0.],
        [1., 1., 0.],
        [2., 1., 0.],
    ];
    let indices = [1, 2, 5, 4, 2, 3, 6, 5];
    let by_point: Vec<f32> = (0..7).map(|i| i as f32).collect();
    let by_corner = [0., 1., 2., 3., 1., 5., 6., 7.];
    let reversed = [6, 5, 4, 3, 2, 1, 0];
    let mut mesh = mesh(&points, &[4, 4], &indices);
    for (name, interpolation, values, indices) in [
        ("constant", "constant", &[4.0][..], None),
        ("uniform", "uniform", &[7.0, 8.0], None),
        ("uniform indexed", "uniform", &[7.0, 8.0], Some(&[1, 0][..])),
        ("varying", "varying", &by_point, None),
        ("vertex", "vertex", &by_point, Some(&reversed)),
        ("faceVarying", "faceVarying", &by_corner, None),
    ] {
        mesh.primvars.push(Primvar {
            name,
            indices,
            ..primvar(interpolation, 1, values)
        });
    }
    let assembled = assemble_one(mesh, &polygon_options());
    assert_eq!(assembled.warnings, [""; 0]);
    let (chunk, points) = only_chunk(&assembled);
    let data = |name: &str, interpolation| {
        let attribute = chunk.attributes.iter().find(|a| a.name == name).unwrap();
        assert_eq!(attribute.interpolation, interpolation);
        &attribute.data
    };
    // The shared edge has one end with the same value on both sides, and one with two values.
    assert_eq!(points.len(), 7);
    assert_eq!(data("constant", Interpolation::Constant), &[4.0]);
    assert_eq!(data("uniform", Interpolation::Uniform), &[7., 7., 8., 8.]);
    assert_eq!(
        data("uniform indexed", Interpolation::Uniform),
        &[8., 8., 7., 7.]
    );
    let varying = data("varying", Interpolation::Vertex);
    let vertex = data("vertex", Interpolation::Vertex);
    for (v, p) in points.iter().enumerate() {
        let source = 1.0 + p.x + 3.0 * p.y;
        assert_eq!(varying[v], source);
        assert_eq!(vertex[v], 6.0 - source);
    }
    let face_varying = data("faceVarying", Interpolation::Vertex);
    for (triangle, face) in chunk.triangles.iter().zip([0, 0, 1, 1]) {
        for &v in triangle {
            let p = points[v as usize] - Vec3::X * face as f32;
            let corner = [0., 1., 3., 2.][p.x as usize + 2 * p.y as usize] as usize;
            assert_eq!(face_varying[v as usize], by_corner[4 * face + corner]);
        }
    }
}

#[test]
fn subsets_split_by_material() {
    let mut mesh = cube();
    mesh.material = 3;
    mesh.subsets = vec![
        Subset {
            faces: &[0, 1],
            material: 1,
        },
        Subset {
            faces: &[1, 2, 77, -1],
            material: 2,
        },
    ];
    mesh.hole_indices = &[5];
    let assembled = assemble_one(mesh, &polygon_options());
    let mut n_triangles = [0; 4];
    for chunk in &assembled.scene.prototypes[0].chunks {
        n_triangles[chunk.material as usize] += chunk.triangles.len();
        // Only the points in use.
        assert!(chunk.positions.len() <= 8);
    }
    assert_eq!(n_triangles, [0, 4, 2, 4]);
    assert_eq!(assembled.warnings.len(), 2);
    assert!(
        assembled
            .warnings
            .iter()
            .all(|w| w.starts_with("/mesh: subset indices: "))
    );
}

#[test]
fn bad_points_cost_their_triangles_only() {
    let grid = Grid::new(3, |x, y| if (x, y) == (0, 0) { f32::NAN } else { 0.0 });
    for scheme in [None, Some(Scheme::CatmullClark), Some(Scheme::Bilinear)] {
        for level in [0, 2] {
            let mut mesh = grid.mesh();
            mesh.subdivision = scheme.map(subdivision);
            let assembled = assemble_one(mesh, &options(level));
            assert_eq!(assembled.n_rejected_triangles, 2);
            let n = if scheme.is_some() {
                16 << (2 * level)
            } else {
                16
            };
            assert_eq!(assembled.n_triangles, n);
            let what = "/mesh: points: 1 points are not finite; 2 triangles dropped";
            assert_eq!(assembled.warnings, [what]);
            let (chunk, _) = only_chunk(&assembled);
            assert!(chunk.positions.iter().flatten().all(|x| x.is_finite()));
        }
    }
}

#[test]
fn meshes_that_do_not_fit_are_left_out() {
    let check = |counts: &[i32], indices: &[i32], attribute: &str| {
        let mut payloads = empty();
        payloads.meshes.push(mesh(&CUBE_POINTS, counts, indices));
        payloads.meshes.push(cube());
        let assembled = assemble(payloads, &polygon_options()).unwrap();
        assert_eq!(assembled.n_triangles, 12);
        assert_eq!(assembled.warnings.len(), 1);
        let warning = &assembled.warnings[0];
        assert!(
            warning.starts_with(&format!("/mesh: {attribute}: ")),
            "{warning}"
        );
    };
    check(&[3, 3], &[0, 1, 2], "faceVertexCounts");
    check(&[-3], &[0, 1, 2], "faceVertexCounts");
    check(&[3], &[0, 1, 8], "faceVertexIndices");
    check(&[3], &[0, 1, -1], "faceVertexIndices");
    check(&[2], &[0, 1], "faceVertexCounts");
}

#[test]
fn primvars_that_do_not_fit_are_left_out() {
    let mut mesh = cube();
    mesh.primvars = vec![
        primvar("vertex", 2, &[0.0; 14]),
        Primvar {
            name: "bad",
            ..primvar("constant", 1, &[f32::INFINITY])
        },
    ];
    let assembled = assemble_one(mesh, &polygon_options());
    let (chunk, _) = only_chunk(&assembled);
    assert_eq!(chunk.attributes.len(), 1);
    assert_eq!(chunk.attributes[0].data, [0.0]);
    assert_eq!(
        assembled.warnings,
        [
            "/mesh: primvars:st: has 7 values, expected 8; primvar ignored",
            "/mesh: primvars:bad: has values that are not finite; zero instead",
        ]
    );
}

#[test]
fn flattened_prims_are_left_out() {
    let mut payloads = empty();
    let mut flat = cube();
    flat.prototype_from_mesh = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0));
    payloads.meshes = vec![flat, mesh(&[], &[], &[])];
    let assembled = assemble(payloads, &polygon_options()).unwrap();
    assert_eq!(assembled.n_triangles, 0);
    assert_eq!(
        assembled.warnings,
        ["/mesh: transform: of no extent or not finite; prim skipped"]
    );
}

#[test]
fn positions_far_away_keep_their_digits() {
    let mut payloads = empty();
    let mut far = cube();
    far.prototype_from_mesh = shift(1e7) * DAffine3::from_scale(DVec3::splat(0.01));
    let mut next = far.clone();
    next.prototype_from_mesh = shift(1.0) * far.prototype_from_mesh;
    payloads.meshes = vec![far, next];
    let scene = assemble(payloads, &polygon_options()).unwrap().scene;
    assert_eq!(scene.origin_world, scene.prototypes[0].center);
    assert!((scene.origin_world - DVec3::X * (1e7 + 0.5)).length() < 1e-6);
    let xs = scene.prototypes[0]
        .chunks
        .iter()
        .flat_map(|c| &c.positions)
        .map(|p| p[0]);
    for x in xs {
        assert!(
            (x.abs() - 0.51).abs() < 1e-6 || (x.abs() - 0.49).abs() < 1e-6,
            "{x}"
        );
    }
}

fn instancer(parent: u32, prototype: u32, shifts: &[f64]) -> InstancesPayload<'static> {
    InstancesPayload {
        path: "/instancer",
        parent,
        prototype,
        parent_from_prototype: shifts.iter().map(|&x| shift(x)).collect(),
        later_parent_from_prototype: Vec::new(),
        visibility: Visibility::ALL,
        primvars: Vec::new(),
    }
}

#[test]
fn single_placements_are_baked_into_the_world() {
    let mut payloads = empty();
    payloads.prototypes = vec![String::new(), "/a".into(), "/b".into()];
    let mut inner = cube();
    inner.prototype = 2;
    inner.primvars = vec![primvar("vertex", 1, &[0.0; 8])];
    payloads.meshes = vec![cube(), inner];
    let mut outer = instancer(0, 1, &[10.0]);
    outer.primvars = vec![primvar("constant", 1, &[0.5])];
    payloads.instances = vec![outer, instancer(1, 2, &[5.0])];
    let assembled = assemble(payloads, &polygon_options()).unwrap();
    let scene = &assembled.scene;
    assert_eq!(scene.prototypes.len(), 1);
    assert!(scene.prototypes[0].instances.is_empty());
    assert_eq!(
        scene.prim_paths,
        ["/mesh", "/mesh", "/instancer", "/instancer"]
    );
    let [first, second] = &scene.prototypes[0].chunks[..] else {
        panic!("two chunks expected");
    };
    assert_eq!((first.prim_idx, second.prim_idx), (0, 1));
    // The bounds reach from −1 to 16.
    assert_eq!(scene.origin_world, DVec3::X * 7.5);
    assert_eq!(second.bounds().center(), Vec3::X * 7.5);
    assert_eq!(second.attributes[0].interpolation, Interpolation::Constant);
    assert_eq!(second.attributes[0].data, [0.5]);
}

#[test]
fn repeated_prototypes_stay_instances() {
    let mut payloads = empty();
    payloads.prototypes = vec![String::new(), "/a".into(), "/unused".into()];
    let mut inner = cube();
    inner.prototype = 1;
    inner.prototype_from_mesh = shift(100.0);
    let mut unused = cube();
    unused.prototype = 2;
    payloads.meshes = vec![inner, unused];
    let mut many = instancer(0, 1, &[0.0, 10.0, 20.0]);
    many.parent_from_prototype[1] = DAffine3::from_scale(DVec3::ZERO);
    many.primvars = vec![primvar("vertex", 1, &[1.0, 2.0, 3.0])];
    payloads.instances = vec![many];
    let assembled = assemble(payloads, &polygon_options()).unwrap();
    let scene = &assembled.scene;
    assert_eq!(scene.prototypes.len(), 2);
    assert_eq!(scene.prototypes[1].center, DVec3::X * 100.0);
    assert_eq!(scene.prototypes[1].chunks.len(), 1);
    let instances = &scene.prototypes[0].instances[0];
    assert_eq!(instances.prim_idx, 2);
    assert_eq!(instances.parent_from_prototype, [shift(0.0), shift(20.0)]);
    assert_eq!(instances.attributes[0].data, [1.0, 3.0]);
    // The world has no meshes of its own: its centre is that of its instances.
    assert_eq!(scene.origin_world, DVec3::X * 110.0);
    assert_eq!(assembled.warnings.len(), 1);
}

#[test]
fn instances_of_nothing_are_dropped() {
    let mut payloads = empty();
    payloads.prototypes = vec![String::new(), "/a".into(), "/b".into()];
    payloads.meshes = vec![cube()];
    payloads.instances = vec![instancer(0, 1, &[0.0, 1.0]), instancer(1, 2, &[0.0, 1.0])];
    let scene = assemble(payloads, &polygon_options()).unwrap().scene;
    assert!(scene.prototypes.iter().all(|p| p.instances.is_empty()));
}

#[test]
fn records_that_point_nowhere_are_errors() {
    let mut payloads = empty();
    let mut lost = cube();
    lost.prototype = 1;
    payloads.meshes = vec![lost];
    let error = assemble(payloads, &polygon_options()).unwrap_err();
    assert!(matches!(error, SceneError::Index { ref path, .. } if path == "/mesh"));
    let mut payloads = empty();
    let mut unshaded = cube();
    unshaded.material = 4;
    payloads.meshes = vec![unshaded];
    let error = assemble(payloads, &polygon_options()).unwrap_err();
    assert!(matches!(error, SceneError::Index { ref attribute, .. } if attribute == "material"));
}

#[test]
fn big_meshes_are_split_into_bounded_chunks() {
    let grid = Grid::new(60, |x, y| ((x * y) % 7) as f32);
    let st: Vec<f32> = grid.points.iter().flat_map(|p| [p[0], p[1]]).collect();
    let mut mesh = grid.mesh();
    mesh.primvars = vec![primvar("vertex", 2, &st)];
    let options = AssembleOptions {
        max_chunk_triangles: 1000,
        ..polygon_options()
    };
    let assembled = assemble_one(mesh, &options);
    let world = &assembled.scene.prototypes[0];
    assert_eq!(assembled.n_triangles, 7200);
    assert_eq!(world.chunks.len(), 8);
    for chunk in &world.chunks {
        assert!(chunk.triangles.len() <= 1000);
        assert!(chunk.positions.len() < 700, "{}", chunk.positions.len());
        for (p, st) in chunk
            .positions
            .iter()
            .zip(chunk.attributes[0].data.chunks(2))
        {
            assert!((p[0] + world.center.x as f32 - st[0]).abs() < 1e-4);
            assert!((p[1] + world.center.y as f32 - st[1]).abs() < 1e-4);
        }
    }
}

#[test]
fn implicit_shapes_get_smooth_normals() {
    let mut payloads = empty();
    payloads.implicits = vec![ImplicitShape {
        path: "/sphere",
        prototype: 0,
        prototype_from_mesh: DAffine3::from_scale(DVec3::new(-2.0, 1.0, 1.0)),
        kind: ImplicitKind::Sphere,
        axis: Axis::Z,
        dimensions: [2.0, 0.0, 0.0],
        material: 1,
        left_handed: false,
        double_sided: true,
        primvars: vec![primvar("constant", 3, &[1.0, 2.0, 3.0])],
        visibility: Visibility::ALL,
    }];
    let assembled = assemble(payloads, &polygon_options()).unwrap();
    check_outward(&assembled);
    let (chunk, points) = only_chunk(&assembled);
    assert!(chunk.double_sided);
    assert_eq!(chunk.attributes[0].data, [1.0, 2.0, 3.0]);
    for (p, n) in points.iter().zip(chunk.normals.as_ref().unwrap()) {
        let expected = (*p / Vec3::new(16.0, 4.0, 4.0)).normalize();
        assert!(Vec3::from_array(*n).distance(expected) < 1e-5);
    }
}

/// A scene of everything.
fn mixed_scene(grid: &Grid) -> Payloads<'_> {
    let mut payloads = empty();
    payloads.prototypes = vec![String::new(), "/a".into(), "/b".into()];
    for i in 0..40 {
        let mut mesh = if i % 3 == 0 { cube() } else { grid.mesh() };
        mesh.prototype = i % 3;
        mesh.prototype_from_mesh = shift(f64::from(i));
        mesh.subdivision = (i % 2 == 0).then(|| subdivision(Scheme::CatmullClark));
        payloads.meshes.push(mesh);
    }
    payloads.instances = vec![
        instancer(0, 1, &[1.0, 2.0]),
        instancer(1, 2, &[1.0, 2.0]),
        instancer(0, 2, &[5.0]),
    ];
    payloads
}

#[test]
fn threads_do_not_change_the_scene() {
    let grid = Grid::new(20, |x, y| ((x * y) % 5) as f32);
    let run = |n_threads: usize| -> (Vec<Vec<MeshChunk>>, Vec<String>) {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .build()
            .unwrap();
        let options = AssembleOptions {
            max_chunk_triangles: 500,
            ..options(2)
        };
        let assembled = pool.install(|| assemble(mixed_scene(&grid), &options).unwrap());
        let prototypes = assembled.scene.prototypes.into_iter();
        (prototypes.map(|p| p.chunks).collect(), assembled.warnings)
    };
    let alone = run(1);
    assert_eq!(alone.0.len(), 3);
    for n_threads in [2, 5] {
        assert!(run(n_threads) == alone);
    }
}
