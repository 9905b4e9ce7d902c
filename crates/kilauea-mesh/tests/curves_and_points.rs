//! Curves and points through `assemble`.

mod stage;

use kilauea_math::{DAffine3, DVec3, Vec3};
use kilauea_mesh::*;
use kilauea_scene::{CurveBasis, CurveProfile, CurvesChunk, Interpolation, Visibility};
use stage::*;

const LINE: [[f32; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [2., 0., 0.], [3., 0., 0.]];

fn curves<'a>(points: &'a [[f32; 3]], curve_vertex_counts: &'a [i32]) -> BasisCurves<'a> {
    BasisCurves {
        path: "/curves",
        prototype: 0,
        prototype_from_curves: DAffine3::IDENTITY,
        points,
        later_points: Vec::new(),
        curve_vertex_counts,
        curve_type: CurveType::Cubic,
        basis: CubicBasis::Bspline,
        wrap: CurveWrap::Pinned,
        widths: None,
        normals: None,
        primvars: Vec::new(),
        material: 2,
        visibility: Visibility::ALL,
    }
}

fn points(points: &[[f32; 3]]) -> Points<'_> {
    Points {
        path: "/points",
        prototype: 0,
        prototype_from_points: DAffine3::IDENTITY,
        points,
        later_points: Vec::new(),
        widths: None,
        primvars: Vec::new(),
        material: 1,
        visibility: Visibility::ALL,
    }
}

fn named<'a>(name: &'a str, interpolation: &str, width: u8, values: &'a [f32]) -> Primvar<'a> {
    Primvar {
        name,
        ..primvar(interpolation, width, values)
    }
}

fn assemble_curves(curves: BasisCurves<'_>) -> Assembled {
    let mut payloads = empty();
    payloads.curves.push(curves);
    assemble(payloads, &AssembleOptions::default()).expect("a valid scene")
}

fn only_curves(assembled: &Assembled) -> &CurvesChunk {
    let [chunk] = &assembled.scene.prototypes[0].curves[..] else {
        panic!("one chunk expected");
    };
    chunk
}

#[test]
fn splines_become_bezier_segments_of_half_the_width() {
    let widths = [0.2];
    let mut hair = curves(&LINE, &[4]);
    hair.prototype_from_curves = DAffine3::from_scale(DVec3::splat(10.0));
    hair.widths = Some(named("widths", "constant", 1, &widths));
    let assembled = assemble_curves(hair);
    assert_eq!(assembled.warnings, [""; 0]);
    let chunk = only_curves(&assembled);
    assert_eq!(
        (chunk.basis, chunk.profile),
        (CurveBasis::Bezier, CurveProfile::Round)
    );
    assert_eq!(chunk.segments, [0, 3, 6]);
    assert_eq!((chunk.points.len(), chunk.material), (10, 2));
    assert!(chunk.radii.iter().all(|r| (r - 1.0).abs() < 1e-6));
    // From end to end, about the middle of the bounds.
    let x: Vec<f32> = chunk.points.iter().map(|p| p[0]).collect();
    assert!(
        x.is_sorted() && (x[0] + 15.0).abs() < 1e-5 && (x[9] - 15.0).abs() < 1e-5,
        "{x:?}"
    );
}

#[test]
fn linear_curves_keep_their_points() {
    let widths = [1.0, 2.0, 3.0, 4.0];
    let mut line = curves(&LINE, &[2, 2]);
    line.curve_type = CurveType::Linear;
    line.widths = Some(named("widths", "vertex", 1, &widths));
    let assembled = assemble_curves(line);
    let chunk = only_curves(&assembled);
    assert_eq!(chunk.basis, CurveBasis::Linear);
    assert_eq!(chunk.segments, [0, 2]);
    assert_eq!(chunk.radii, [0.5, 1.0, 1.5, 2.0]);
}

#[test]
fn primvars_come_per_control_point_or_per_segment() {
    let (by_curve, by_end, by_point) = ([7.0, 8.0], [0.0, 3.0, 9.0, 9.0], [1.0, 2.0, 4.0, 8.0]);
    let mut hair = curves(&LINE, &[2, 2]);
    hair.primvars = vec![
        named("by_curve", "uniform", 1, &by_curve),
        named("by_end", "varying", 1, &by_end),
        named("by_point", "vertex", 1, &by_point),
    ];
    let assembled = assemble_curves(hair);
    assert_eq!(assembled.warnings, [""; 0]);
    let [uniform, varying, vertex] = &only_curves(&assembled).attributes[..] else {
        panic!("three primvars");
    };
    assert_eq!(
        (uniform.interpolation, &uniform.data[..]),
        (Interpolation::Uniform, &[7.0, 8.0][..])
    );
    assert_eq!(varying.interpolation, Interpolation::Vertex);
    let is_near = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
    assert!(is_near(
        &varying.data,
        &[0.0, 1.0, 2.0, 3.0, 9.0, 9.0, 9.0, 9.0]
    ));
    // Two points and their reflections beyond the ends make a straight line.
    assert!(
        is_near(&vertex.data[..4], &[1.0, 4.0 / 3.0, 5.0 / 3.0, 2.0]),
        "{:?}",
        vertex.data
    );
}

#[test]
fn normals_make_ribbons() {
    let normals = [0.0, 2.0, 0.0];
    let mut ribbon = curves(&LINE, &[4]);
    ribbon.normals = Some(named("normals", "constant", 3, &normals));
    let assembled = assemble_curves(ribbon);
    let chunk = only_curves(&assembled);
    assert_eq!(chunk.profile, CurveProfile::Ribbon);
    assert!(
        chunk
            .normals
            .iter()
            .flatten()
            .all(|n| Vec3::from_array(*n).distance(Vec3::Y) < 1e-6)
    );
}

#[test]
fn broken_curves_are_left_out_and_named() {
    let mut broken = LINE;
    broken[3][1] = f32::NAN;
    let assembled = assemble_curves(curves(&broken, &[2, 2]));
    assert_eq!(only_curves(&assembled).segments.len(), 1);
    assert_eq!(
        assembled.warnings,
        ["/curves: points: 1 curves skipped: points are not finite"]
    );

    for (counts, expected) in [
        (
            &[3, 2][..],
            "/curves: curveVertexCounts: add up to 5, but there are 4 points",
        ),
        (&[5, -1][..], "/curves: curveVertexCounts: [1] is -1"),
        (&[1, 3][..], "/curves: curveVertexCounts: 1 curves skipped"),
    ] {
        let warnings = assemble_curves(curves(&LINE, counts)).warnings;
        assert!(warnings[0].starts_with(expected), "{warnings:?}");
    }
    let widths = [1.0, 2.0];
    let mut wrong = curves(&LINE, &[4]);
    wrong.widths = Some(named("widths", "vertex", 1, &widths));
    let assembled = assemble_curves(wrong);
    let expected = "/curves: widths: has 2 values, expected 4; 1 instead";
    assert_eq!(assembled.warnings, [expected]);
    assert!(only_curves(&assembled).radii.iter().all(|r| *r == 0.5));
}

#[test]
fn many_curves_are_split_between_curves() {
    let counts = [4; 50];
    let all: Vec<[f32; 3]> = LINE.iter().copied().cycle().take(200).collect();
    let mut payloads = empty();
    payloads.curves.push(curves(&all, &counts));
    let options = AssembleOptions {
        max_chunk_triangles: 10,
        ..AssembleOptions::default()
    };
    let assembled = assemble(payloads, &options).unwrap();
    let chunks = &assembled.scene.prototypes[0].curves;
    // Three segments a curve.
    assert_eq!(chunks.len(), 17);
    assert_eq!(chunks.iter().map(|c| c.segments.len()).sum::<usize>(), 150);
    assert!(chunks.iter().all(|c| c.segments.len() <= 10));
}

#[test]
fn points_are_spheres_of_half_the_width() {
    let (widths, colors) = ([1.0, 0.0, -1.0, 3.0], [1.0, 2.0, 3.0, 4.0]);
    let mut some = points(&LINE);
    some.widths = Some(named("widths", "vertex", 1, &widths));
    some.primvars = vec![named("paint", "vertex", 1, &colors)];
    let mut payloads = empty();
    payloads.points.push(some);
    let assembled = assemble(payloads, &AssembleOptions::default()).unwrap();
    let chunk = &assembled.scene.prototypes[0].points[0];
    assert_eq!(chunk.radii, [0.5, 1.5]);
    assert_eq!(chunk.attributes[0].data, [1.0, 4.0]);
    let expected = "/points: widths: 1 are negative or not finite; points not drawn";
    assert_eq!(assembled.warnings, [expected]);
    assert_eq!(assembled.scene.prim_paths, ["/points"]);
}
