//! Subdivision surfaces against what is known of them.

mod stage;

use kilauea_math::Vec3;
use kilauea_mesh::*;
use stage::*;

fn limit<'a>(mut mesh: PolyMesh<'a>, subdivision: Subdivision<'a>, level: u32) -> Assembled {
    mesh.subdivision = Some(subdivision);
    let assembled = assemble_one(mesh, &options(level));
    assert_eq!(assembled.warnings, [""; 0]);
    assembled
}

fn index_near(points: &[Vec3], p: Vec3) -> Option<usize> {
    points.iter().position(|q| q.distance(p) < 2e-5)
}

#[track_caller]
fn assert_has(points: &[Vec3], p: Vec3) {
    let nearest = points
        .iter()
        .map(|q| q.distance(p))
        .fold(f32::INFINITY, f32::min);
    assert!(nearest < 1e-5, "{p} is {nearest} away");
}

#[test]
fn cube_has_the_known_limit() {
    for level in 0..4 {
        let assembled = limit(cube(), subdivision(Scheme::CatmullClark), level);
        let (chunk, points) = only_chunk(&assembled);
        assert_eq!(chunk.triangles.len(), 12 << (2 * level));
        // By hand: (9 P + 4 ΣE + ΣF) / 24, and 68/81 above the middle of a face.
        assert_has(&points, Vec3::splat(0.5));
        assert_has(&points, Vec3::new(-0.5, 0.5, -0.5));
        if level > 0 {
            assert_has(&points, Vec3::new(0.0, 0.0, 68.0 / 81.0));
        }
        let normals = chunk.normals.as_ref().unwrap();
        // Smooth everywhere: no vertex is split.
        assert_eq!(points.len(), 6 * (1 << (2 * level)) + 2);
        let corner = index_near(&points, Vec3::splat(0.5)).unwrap();
        assert!(Vec3::from_array(normals[corner]).distance(Vec3::ONE.normalize()) < 1e-5);
    }
}

/// Points and normals of each level are also those of the next.
fn check_levels_agree<'a>(mesh: &PolyMesh<'a>, subdivision: &Subdivision<'a>, what: &str) {
    let finest = limit(mesh.clone(), subdivision.clone(), 4);
    let (fine, fine_points) = only_chunk(&finest);
    for level in 0..4 {
        let coarse = limit(mesh.clone(), subdivision.clone(), level);
        let (chunk, points) = only_chunk(&coarse);
        assert_eq!(chunk.prim_idx, 0);
        for (v, p) in points.iter().enumerate() {
            let normal = Vec3::from_array(normals(chunk)[v]);
            let matches = fine_points
                .iter()
                .enumerate()
                .filter(|(_, q)| q.distance(*p) < 2e-5);
            let best = matches
                .map(|(i, _)| normal.dot(Vec3::from_array(normals(fine)[i])))
                .fold(f32::NEG_INFINITY, f32::max);
            assert!(
                best > -2.0,
                "{what}: level {level} has {p}, the finest has not"
            );
            assert!(
                best > 1.0 - 1e-4,
                "{what}: normals differ at {p}, level {level}: {best}"
            );
        }
    }
}

#[test]
fn levels_lie_on_the_same_surface() {
    let hills = |x: usize, y: usize| ((x * 7 + y * 13) % 5) as f32 * 0.3;
    let grid = Grid::new(4, hills);
    // A mesh of a pentagon, a triangle and quads, with vertices of valence 3 to 5.
    let points = [
        [0., 0., 0.2],
        [1., 0., 0.],
        [2., 0., 0.3],
        [2., 1., 0.],
        [2., 2., 0.1],
        [1., 2., 0.],
        [0., 2., 0.4],
        [0., 1., 0.],
        [1., 1., 0.6],
        [1.5, 1.6, 0.3],
    ];
    let counts = [4, 4, 3, 4, 5];
    let indices = [0, 1, 8, 7, 1, 2, 3, 8, 3, 9, 8, 3, 4, 5, 9, 5, 6, 7, 8, 9];
    let mixed = mesh(&points, &counts, &indices);
    for boundary in [
        BoundaryInterpolation::EdgeOnly,
        BoundaryInterpolation::EdgeAndCorner,
    ] {
        let mut smooth = subdivision(Scheme::CatmullClark);
        smooth.interpolate_boundary = boundary;
        check_levels_agree(&cube(), &smooth, "cube");
        if boundary == BoundaryInterpolation::EdgeAndCorner {
            check_levels_agree(&grid.mesh(), &smooth, "grid");
            check_levels_agree(&mixed, &smooth, "mixed");
        }
        // A crease around the top of the cube, and one that ends inside.
        let mut creased = smooth.clone();
        creased.crease_indices = &[4, 5, 7, 6, 4];
        creased.crease_lengths = &[5];
        creased.crease_sharpnesses = &[10.0];
        check_levels_agree(&cube(), &creased, "creased cube");
        creased.crease_indices = &[0, 1, 3, 7];
        creased.crease_lengths = &[4];
        creased.crease_sharpnesses = &[10.0, 12.0, 10.0];
        check_levels_agree(&cube(), &creased, "cube with darts");
    }
    let triangles: Vec<i32> = grid
        .indices
        .chunks(4)
        .flat_map(|q| [q[0], q[1], q[2], q[0], q[2], q[3]])
        .collect();
    let triangle_counts = vec![3; triangles.len() / 3];
    let triangle_grid = mesh(&grid.points, &triangle_counts, &triangles);
    check_levels_agree(&triangle_grid, &subdivision(Scheme::Loop), "loop grid");
}

#[test]
fn regular_patch_is_the_bicubic_b_spline() {
    let height = |x: usize, y: usize| ((x * x * 3 + y * 5 + x * y) % 7) as f32;
    let grid = Grid::new(5, height);
    let assembled = limit(grid.mesh(), subdivision(Scheme::CatmullClark), 2);
    let (chunk, points) = only_chunk(&assembled);
    // Uniform cubic B-spline weights and their derivatives at t = 0, 1/4, 1/2.
    let basis = |t: f32| {
        let s = 1.0 - t;
        [
            s * s * s / 6.0,
            (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
            (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0,
            t * t * t / 6.0,
        ]
    };
    let slope = |t: f32| {
        let s = 1.0 - t;
        [
            -0.5 * s * s,
            1.5 * t * t - 2.0 * t,
            -1.5 * s * s + 2.0 * s,
            0.5 * t * t,
        ]
    };
    for (u, v) in [(0.0, 0.0), (0.5, 0.5), (0.25, 0.75), (0.0, 0.5)] {
        let sum = |a: [f32; 4], b: [f32; 4]| -> f32 {
            let term = |i: usize| a[i % 4] * b[i / 4] * height(1 + i % 4, 1 + i / 4);
            (0..16).map(term).sum()
        };
        let expected = Vec3::new(2.0 + u, 2.0 + v, sum(basis(u), basis(v)));
        let at = index_near(&points, expected).unwrap();
        let normal = Vec3::new(-sum(slope(u), basis(v)), -sum(basis(u), slope(v)), 1.0).normalize();
        let found = Vec3::from_array(chunk.normals.as_ref().unwrap()[at]);
        assert!(found.distance(normal) < 1e-4, "{found}, not {normal}");
    }
}

#[test]
fn boundary_curve_is_the_cubic_b_spline() {
    let height = |x: usize, y: usize| {
        if y == 0 {
            (x * x) as f32
        } else {
            9.0 - x as f32
        }
    };
    let grid = Grid::new(3, height);
    let assembled = limit(grid.mesh(), subdivision(Scheme::CatmullClark), 1);
    let (_, points) = only_chunk(&assembled);
    // Weights 1/6, 4/6, 1/6 at a vertex; 1/48, 23/48, 23/48, 1/48 in the middle.
    assert_has(&points, Vec3::new(1.0, 0.0, (4.0 + 4.0) / 6.0));
    let middle = (23.0 + 23.0 * 4.0 + 9.0) / 48.0;
    assert_has(&points, Vec3::new(1.5, 0.0, middle));
    // Corners stay.
    assert_has(&points, Vec3::new(0.0, 0.0, 0.0));
    assert_has(&points, Vec3::new(3.0, 0.0, 9.0));
}

#[test]
fn smooth_corners_leave_their_vertex() {
    let grid = Grid::new(2, |_, _| 0.0);
    let mut round = subdivision(Scheme::CatmullClark);
    round.interpolate_boundary = BoundaryInterpolation::EdgeOnly;
    let assembled = limit(grid.mesh(), round, 0);
    let (_, points) = only_chunk(&assembled);
    assert_has(&points, Vec3::new(1.0 / 6.0, 1.0 / 6.0, 0.0));
}

#[test]
fn undrawn_boundary_faces_still_support_others() {
    let grid = Grid::new(3, |x, y| (x * y) as f32);
    let mut none = subdivision(Scheme::CatmullClark);
    none.interpolate_boundary = BoundaryInterpolation::None;
    let assembled = limit(grid.mesh(), none, 2);
    let (chunk, points) = only_chunk(&assembled);
    assert_eq!(chunk.triangles.len(), 2 * 16);
    assert_has(&points, Vec3::new(1.0, 1.0, 1.0));
    assert_has(&points, Vec3::new(1.5, 1.5, 2.25));
}

#[test]
fn infinitely_sharp_cube_stays_a_cube() {
    let mut sharp = subdivision(Scheme::CatmullClark);
    sharp.crease_indices = &[
        0, 1, 1, 3, 3, 2, 2, 0, 4, 5, 5, 7, 7, 6, 6, 4, 0, 4, 1, 5, 2, 6, 3, 7,
    ];
    sharp.crease_lengths = &[2; 12];
    sharp.crease_sharpnesses = &[10.0; 12];
    for level in 0..4_u32 {
        let assembled = limit(cube(), sharp.clone(), level);
        let (chunk, points) = only_chunk(&assembled);
        let normals = chunk.normals.as_ref().unwrap();
        for (p, n) in points.iter().zip(normals) {
            let n = Vec3::from_array(*n);
            assert!((p.abs().max_element() - 1.0).abs() < 1e-6);
            // The normal is that of a side the point lies on.
            assert!((n.abs().max_element() - 1.0).abs() < 1e-6);
            assert!((n.dot(*p) - 1.0).abs() < 1e-5);
        }
        // Each side has vertices of its own.
        assert_eq!(points.len(), 6 * ((1 << level) + 1_usize).pow(2));
    }
}

#[test]
fn semi_sharp_creases_lie_between_smooth_and_sharp() {
    let at_sharpness = |sharpness: f32| {
        let sharpnesses = [sharpness];
        let mut creased = subdivision(Scheme::CatmullClark);
        creased.crease_indices = &[4, 5, 7, 6, 4];
        creased.crease_lengths = &[5];
        creased.crease_sharpnesses = &sharpnesses;
        let mut mesh = cube();
        mesh.subdivision = Some(creased);
        let assembled = assemble_one(mesh, &options(4));
        let (_, points) = only_chunk(&assembled);
        points.iter().map(|p| p.z).fold(f32::NEG_INFINITY, f32::max)
    };
    let heights: Vec<f32> = [0.0, 0.3, 0.7, 1.0, 1.5, 2.0, 3.0, 10.0]
        .map(at_sharpness)
        .to_vec();
    assert!(
        heights.is_sorted() && heights[0] < heights[1],
        "{heights:?}"
    );
    assert!((heights[7] - 1.0).abs() < 1e-6);
    // Fractions of a level blend linearly.
    let between = heights[0] + 0.3 * (heights[3] - heights[0]);
    assert!((heights[1] - between).abs() < 0.02, "{heights:?}");
}

#[test]
fn sharp_corner_stays_and_others_do_not() {
    let mut cornered = subdivision(Scheme::CatmullClark);
    cornered.corner_indices = &[7];
    cornered.corner_sharpnesses = &[10.0];
    let assembled = limit(cube(), cornered, 3);
    let (_, points) = only_chunk(&assembled);
    assert_has(&points, Vec3::ONE);
    assert!(points.iter().all(|p| p.distance(-Vec3::ONE) > 0.1));
}

#[test]
fn loop_icosahedron_is_symmetric() {
    let g = 0.5 * (1.0 + 5.0_f32.sqrt());
    let points = [
        [-1., g, 0.],
        [1., g, 0.],
        [-1., -g, 0.],
        [1., -g, 0.],
        [0., -1., g],
        [0., 1., g],
        [0., -1., -g],
        [0., 1., -g],
        [g, 0., -1.],
        [g, 0., 1.],
        [-g, 0., -1.],
        [-g, 0., 1.],
    ];
    #[rustfmt::skip]
    let indices = [
        0, 11, 5, 0, 5, 1, 0, 1, 7, 0, 7, 10, 0, 10, 11, 1, 5, 9, 5, 11, 4, 11, 10, 2, 10, 7, 6,
        7, 1, 8, 3, 9, 4, 3, 4, 2, 3, 2, 6, 3, 6, 8, 3, 8, 9, 4, 9, 5, 2, 4, 11, 6, 2, 10, 8, 6, 7,
        9, 8, 1,
    ];
    let counts = [3; 20];
    let mesh = mesh(&points, &counts, &indices);
    let assembled = limit(mesh.clone(), subdivision(Scheme::Loop), 0);
    let (_, coarse) = only_chunk(&assembled);
    assert_eq!(coarse.len(), 12);
    let radius = coarse[0].length();
    // Loop's limit mask for valence 5 along the axis: each neighbour contributes cos = 1/√5.
    let beta = (0.625 - (0.375 + 0.25 * (std::f32::consts::TAU / 5.0).cos()).powi(2)) / 5.0;
    let weight = 1.0 / (5.0 + 0.375 / beta);
    let expected = (1.0 + g * g).sqrt() * (1.0 - 5.0 * weight + 5.0 * weight / 5.0_f32.sqrt());
    for p in &coarse {
        assert!((p.length() - radius).abs() < 1e-5 && (radius - expected).abs() < 1e-5);
    }
    check_levels_agree(&mesh, &subdivision(Scheme::Loop), "icosahedron");
    let assembled = limit(mesh, subdivision(Scheme::Loop), 3);
    let (chunk, points) = only_chunk(&assembled);
    for (p, n) in points.iter().zip(chunk.normals.as_ref().unwrap()) {
        for mirror in [
            Vec3::new(-1., 1., 1.),
            Vec3::new(1., -1., 1.),
            Vec3::new(1., 1., -1.),
        ] {
            assert_has(&points, mirror * *p);
        }
        assert!(Vec3::from_array(*n).dot(p.normalize()) > 0.99);
    }
}

#[test]
fn mirrored_and_left_handed_normals_point_outward() {
    for (scale, left_handed) in [(1.0, false), (-1.0, false), (1.0, true), (-2.0, true)] {
        for level in [0, 2] {
            let mut mesh = cube();
            let reversed: Vec<i32> = CUBE_INDICES
                .chunks(4)
                .flat_map(|q| [q[0], q[3], q[2], q[1]])
                .collect();
            if left_handed {
                mesh.face_vertex_indices = &reversed;
            }
            mesh.left_handed = left_handed;
            let mirror = kilauea_math::DVec3::new(scale, 1.0, 3.0);
            mesh.prototype_from_mesh = kilauea_math::DAffine3::from_scale(mirror);
            let assembled = limit(mesh, subdivision(Scheme::CatmullClark), level);
            let (chunk, points) = only_chunk(&assembled);
            for (triangle, normal) in chunk.triangles.iter().zip(area_normals(chunk)) {
                for &v in triangle {
                    assert!(normal.dot(points[v as usize]) > 0.0);
                    let shading = Vec3::from_array(chunk.normals.as_ref().unwrap()[v as usize]);
                    assert!(shading.dot(normal) > 0.0);
                }
            }
        }
    }
}

#[test]
fn primvars_follow_their_interpolation() {
    let grid = Grid::new(4, |_, _| 0.0);
    let by_point: Vec<f32> = grid.points.iter().map(|p| p[0] * p[0]).collect();
    let by_face: Vec<f32> = (0..16).map(|i| i as f32).collect();
    let mut mesh = grid.mesh();
    for (name, interpolation, values) in [
        ("constant", "constant", &[5.0][..]),
        ("uniform", "uniform", &by_face),
        ("varying", "varying", &by_point),
        ("vertex", "vertex", &by_point),
    ] {
        mesh.primvars.push(Primvar {
            name,
            ..primvar(interpolation, 1, values)
        });
    }
    let assembled = limit(mesh, subdivision(Scheme::CatmullClark), 1);
    let (chunk, points) = only_chunk(&assembled);
    let values = |name: &str| {
        let attribute = chunk.attributes.iter().find(|a| a.name == name).unwrap();
        &attribute.data
    };
    assert_eq!(values("constant"), &[5.0]);
    for (t, uniform) in values("uniform").iter().enumerate() {
        let middle = chunk.triangles[t]
            .iter()
            .map(|&v| points[v as usize])
            .sum::<Vec3>()
            / 3.0;
        assert_eq!(*uniform, middle.x.floor() + 4.0 * middle.y.floor());
    }
    let at = index_near(&points, Vec3::new(2.0, 2.0, 0.0)).unwrap();
    assert_eq!(values("varying")[at], 4.0);
    // The B-spline of x² is x² + 1/3.
    assert!((values("vertex")[at] - (4.0 + 1.0 / 3.0)).abs() < 1e-5);
    let at = index_near(&points, Vec3::new(1.5, 2.0, 0.0)).unwrap();
    assert_eq!(values("varying")[at], 2.5);
    assert!((values("vertex")[at] - (2.25 + 1.0 / 3.0)).abs() < 1e-5);
}

/// All values of `st` where a point is.
fn st_at(assembled: &Assembled, p: Vec3) -> Vec<[f32; 2]> {
    let (chunk, points) = only_chunk(assembled);
    let mut values: Vec<[f32; 2]> = (0..points.len())
        .filter(|&v| points[v].distance(p) < 1e-4)
        .map(|v| {
            [
                chunk.attributes[0].data[2 * v],
                chunk.attributes[0].data[2 * v + 1],
            ]
        })
        .collect();
    values.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    values
}

#[test]
fn face_varying_data_without_seams_follows_the_surface() {
    let grid = Grid::new(3, |x, y| (x * y) as f32);
    let st: Vec<f32> = grid
        .indices
        .iter()
        .flat_map(|&i| [grid.points[i as usize][0], grid.points[i as usize][2]])
        .collect();
    for level in [0, 2] {
        let mut mesh = grid.mesh();
        mesh.primvars.push(primvar("faceVarying", 2, &st));
        let assembled = limit(mesh, subdivision(Scheme::CatmullClark), level);
        let (chunk, points) = only_chunk(&assembled);
        assert_eq!(points.len(), (3 * (1 << level) + 1_usize).pow(2));
        for (p, st) in points.iter().zip(chunk.attributes[0].data.chunks(2)) {
            assert!((p.x - st[0]).abs() < 1e-5 && (p.z - st[1]).abs() < 1e-5);
        }
    }
}

#[test]
fn seams_follow_the_face_varying_rule() {
    // Two rows of quads; the lower is one region, the upper two, so that three meet in the middle.
    let grid = Grid::new(2, |_, _| 0.0);
    let region = |face: usize| [0.0, 0.0, 100.0, 200.0][face];
    let st: Vec<f32> = grid
        .indices
        .iter()
        .enumerate()
        .flat_map(|(c, &i)| {
            let [x, y, _] = grid.points[i as usize];
            [x * x + region(c / 4), y]
        })
        .collect();
    let check = |rule: &str, level: u32, at: [f32; 2], expected: &[[f32; 2]]| {
        let mut mesh = grid.mesh();
        mesh.primvars.push(primvar("faceVarying", 2, &st));
        let mut seamed = subdivision(Scheme::CatmullClark);
        seamed.face_varying_linear_interpolation = rule.parse().unwrap();
        let assembled = limit(mesh, seamed, level);
        let found = st_at(&assembled, Vec3::new(at[0], at[1], 0.0));
        assert_eq!(found.len(), expected.len(), "{rule} {level}: {found:?}");
        for (a, b) in found.iter().zip(expected) {
            let close = (a[0] - b[0]).abs() < 1e-4 && (a[1] - b[1]).abs() < 1e-4;
            assert!(close, "{rule}, level {level}, at {at:?}: {found:?}");
        }
    };
    let third = 1.0 / 3.0;
    for level in [0, 1, 3] {
        // In the middle: the lower region's edge is a smooth curve or pinned; corners of one face
        // are rounded or pinned.
        let pinned = [[1.0, 1.0], [101.0, 1.0], [201.0, 1.0]];
        let curve = [[1.0 + third, 1.0], [101.0, 1.0], [201.0, 1.0]];
        check("cornersOnly", level, [1.0, 1.0], &curve);
        for rule in ["cornersPlus1", "cornersPlus2", "boundaries", "all"] {
            check(rule, level, [1.0, 1.0], &pinned);
        }
        let rounded = [
            [1.0 + third, 1.0],
            [(4.0 + 0.0 + 1.0) / 6.0 + 100.0, 1.0 + 1.0 / 6.0],
            [(4.0 + 4.0 + 1.0) / 6.0 + 200.0, 1.0 + 1.0 / 6.0],
        ];
        check("none", level, [1.0, 1.0], &rounded);
        // Along the lower boundary in the middle.
        check("cornersOnly", level, [1.0, 0.0], &[[1.0 + third, 0.0]]);
        check("cornersPlus2", level, [1.0, 0.0], &[[1.0 + third, 0.0]]);
        check("boundaries", level, [1.0, 0.0], &[[1.0, 0.0]]);
        // Where the seam meets the left boundary, two regions of one face each.
        check(
            "cornersOnly",
            level,
            [0.0, 1.0],
            &[[0.0, 1.0], [100.0, 1.0]],
        );
    }
    // Linear inside as well.
    check("all", 1, [0.5, 0.5], &[[0.5, 0.5]]);
}

#[test]
fn seams_that_end_inside_are_pinned_by_corners_plus_2() {
    // A slit from the left boundary to the middle.
    let grid = Grid::new(2, |_, _| 0.0);
    let st: Vec<f32> = grid
        .indices
        .iter()
        .enumerate()
        .flat_map(|(c, &i)| {
            let [x, y, _] = grid.points[i as usize];
            let is_above_slit = c / 4 == 2 && (x, y) == (0.0, 1.0);
            [if is_above_slit { -3.0 } else { x }, y]
        })
        .collect();
    for (rule, u) in [
        // On the crease through both ends of the slit: (0 + 4 − 3) / 6.
        ("cornersOnly", 1.0 / 6.0),
        ("cornersPlus1", 1.0 / 6.0),
        ("cornersPlus2", 1.0),
        ("boundaries", 1.0),
    ] {
        let mut mesh = grid.mesh();
        mesh.primvars.push(primvar("faceVarying", 2, &st));
        let mut slit = subdivision(Scheme::CatmullClark);
        slit.face_varying_linear_interpolation = rule.parse().unwrap();
        let found = st_at(&limit(mesh, slit, 2), Vec3::new(1.0, 1.0, 0.0));
        assert_eq!(found.len(), 1, "{rule}: {found:?}");
        assert!((found[0][0] - u).abs() < 1e-5, "{rule}: {found:?}");
    }
}

#[test]
fn holes_shape_the_surface_and_are_not_drawn() {
    let whole = limit(cube(), subdivision(Scheme::CatmullClark), 2);
    let mut mesh = cube();
    mesh.hole_indices = &[1];
    let holed = limit(mesh, subdivision(Scheme::CatmullClark), 2);
    let (whole, points) = only_chunk(&whole);
    let (chunk, holed_points) = only_chunk(&holed);
    assert_eq!(chunk.triangles.len() * 6, whole.triangles.len() * 5);
    for p in holed_points {
        assert_has(&points, p);
    }
}

#[test]
fn non_manifold_edges_are_sharp() {
    // Three quads on one edge.
    let points = [
        [0., 0., 0.],
        [0., 0., 1.],
        [1., 0., 0.],
        [1., 0., 1.],
        [-1., 1., 0.],
        [-1., 1., 1.],
        [-1., -1., 0.],
        [-1., -1., 1.],
    ];
    let counts = [4; 3];
    let indices = [0, 2, 3, 1, 0, 1, 5, 4, 0, 1, 7, 6];
    let assembled = limit(
        mesh(&points, &counts, &indices),
        subdivision(Scheme::CatmullClark),
        2,
    );
    let (_, points) = only_chunk(&assembled);
    for z in [0.0, 0.25, 0.5, 0.75, 1.0] {
        assert_has(&points, Vec3::new(0.0, 0.0, z));
    }
}

#[test]
fn bilinear_keeps_the_cage() {
    let grid = Grid::new(2, |x, y| (x * y) as f32);
    let assembled = limit(grid.mesh(), subdivision(Scheme::Bilinear), 2);
    let (chunk, points) = only_chunk(&assembled);
    assert!(chunk.normals.is_none());
    assert_eq!(points.len(), 81);
    for p in points {
        assert!((p.z - p.x * p.y).abs() < 1e-6);
    }
}

#[test]
fn loop_of_quads_is_drawn_with_a_warning() {
    let mut mesh = cube();
    mesh.subdivision = Some(subdivision(Scheme::Loop));
    let assembled = assemble_one(mesh, &options(2));
    assert_eq!(assembled.n_triangles, 12);
    assert!(assembled.warnings[0].starts_with("/mesh: subdivisionScheme: "));
}

#[test]
fn level_follows_the_size_on_screen() {
    let grid = Grid::new(30, |_, _| 0.0);
    let n_triangles = |distance: f64| {
        let mut mesh = grid.mesh();
        mesh.subdivision = Some(subdivision(Scheme::CatmullClark));
        mesh.prototype_from_mesh =
            kilauea_math::DAffine3::from_translation(-distance * kilauea_math::DVec3::Z);
        assemble_one(mesh, &options(4)).n_triangles
    };
    // Edges of one unit cover 640 / distance pixels, and 2 are fine enough.
    assert_eq!(n_triangles(321.0), 1800);
    assert_eq!(n_triangles(319.0), 1800 * 4);
    assert_eq!(n_triangles(81.0), 1800 * 16);
    assert_eq!(n_triangles(0.0), 1800 * 256);
}
