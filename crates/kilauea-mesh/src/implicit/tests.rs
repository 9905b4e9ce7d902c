use std::f64::consts::PI;

use kilauea_scene::Visibility;

use super::*;

fn shape(kind: ImplicitKind, axis: Axis, dimensions: [f64; 3]) -> ImplicitShape<'static> {
    ImplicitShape {
        path: "/shape",
        prototype: 0,
        prototype_from_mesh: DAffine3::IDENTITY,
        kind,
        axis,
        dimensions,
        material: 0,
        left_handed: false,
        double_sided: false,
        primvars: Vec::new(),
        visibility: Visibility::ALL,
    }
}

/// Area and volume by the divergence theorem, over triangles.
fn area_and_volume(t: &Tessellation) -> (f64, f64) {
    let mut sums = (0.0, 0.0);
    for face in t.corner_points.chunks(t.face_size) {
        for i in 2..face.len() {
            let [a, b, c] = [face[0], face[i - 1], face[i]]
                .map(|v| DVec3::from_array(t.points[v as usize].map(f64::from)));
            sums.0 += 0.5 * (b - a).cross(c - a).length();
            sums.1 += a.dot(b.cross(c)) / 6.0;
        }
    }
    sums
}

fn check(kind: ImplicitKind, dimensions: [f64; 3], area: f64, volume: f64) {
    for axis in [Axis::X, Axis::Y, Axis::Z] {
        let shape = shape(kind, axis, dimensions);
        let t = tessellate(&shape, 0.0, 2.0);
        let (a, v) = area_and_volume(&t);
        assert!(
            (a / area - 1.0).abs() < 2e-3,
            "{kind:?}: area {a}, not {area}"
        );
        assert!(
            (v / volume - 1.0).abs() < 4e-3,
            "{kind:?}: volume {v}, not {volume}"
        );
        let mut bounds = DBounds::EMPTY;
        for p in &t.points {
            bounds.include(DVec3::from_array(p.map(f64::from)));
        }
        let expected = shape_bounds(&shape);
        assert!(
            bounds.min.distance(expected.min) < 1e-5,
            "{kind:?} {axis:?}"
        );
        assert!(
            bounds.max.distance(expected.max) < 1e-5,
            "{kind:?} {axis:?}"
        );
        // Normals agree with winding.
        let Some(normals) = &t.normals else { continue };
        for face in t.corner_points.chunks(3) {
            let [a, b, c] =
                [0, 1, 2].map(|i| DVec3::from_array(t.points[face[i] as usize].map(f64::from)));
            let geometric = (b - a).cross(c - a).normalize();
            for &v in face {
                let n = &normals[3 * v as usize..][..3];
                let n = DVec3::new(n[0].into(), n[1].into(), n[2].into());
                assert!((n.length() - 1.0).abs() < 1e-6);
                assert!(n.dot(geometric) > 0.99, "{kind:?}");
            }
        }
    }
}

#[test]
fn shapes_have_their_area_and_volume() {
    check(
        ImplicitKind::Sphere,
        [2.0, 0.0, 0.0],
        16.0 * PI,
        32.0 / 3.0 * PI,
    );
    check(ImplicitKind::Cube, [2.0, 0.0, 0.0], 24.0, 8.0);
    check(ImplicitKind::Cylinder, [1.0, 1.0, 3.0], 8.0 * PI, 3.0 * PI);
    let side = 5.0_f64.sqrt();
    check(
        ImplicitKind::Cylinder,
        [2.0, 1.0, 2.0],
        PI * (5.0 + 3.0 * side),
        2.0 * PI / 3.0 * 7.0,
    );
    check(
        ImplicitKind::Cone,
        [1.0, 0.0, 2.0],
        PI * (1.0 + side),
        2.0 * PI / 3.0,
    );
    check(
        ImplicitKind::Capsule,
        [1.0, 1.0, 2.0],
        8.0 * PI,
        (2.0 + 4.0 / 3.0) * PI,
    );
}

#[test]
fn spheres_refine_with_their_size() {
    let sphere = shape(ImplicitKind::Sphere, Axis::Z, [1.0, 0.0, 0.0]);
    let n = |pixels| tessellate(&sphere, pixels, 2.0).points.len();
    assert_eq!(n(1.0), 72 * 35 + 2);
    assert_eq!(n(f64::INFINITY), 256 * 127 + 2);
    assert_eq!(n(f64::NAN), 72 * 35 + 2);
    assert!(n(30.0) > n(1.0) && n(30.0) < n(1e3));
}

#[test]
fn planes_look_along_their_axis() {
    for (axis, size) in [
        (Axis::X, DVec3::new(0.0, 3.0, 2.0)),
        (Axis::Y, DVec3::new(2.0, 0.0, 3.0)),
        (Axis::Z, DVec3::new(2.0, 3.0, 0.0)),
    ] {
        let t = tessellate(&shape(ImplicitKind::Plane, axis, [2.0, 3.0, 0.0]), 0.0, 2.0);
        let p: Vec<DVec3> = t
            .corner_points
            .iter()
            .map(|&v| DVec3::from_array(t.points[v as usize].map(f64::from)))
            .collect();
        let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize();
        assert!(normal.distance(on_axis(axis, 0.0, 0.0, 1.0)) < 1e-9);
        assert!((p[2] - p[0]).abs().distance(size) < 1e-6);
    }
}

#[test]
fn shapes_of_no_extent_are_refused() {
    for dimensions in [[0.0; 3], [-1.0, 0.0, 0.0], [f64::NAN, 0.0, 1.0]] {
        let mut report = Report::default();
        assert!(!check_dimensions(
            &shape(ImplicitKind::Sphere, Axis::Z, dimensions),
            &mut report
        ));
        assert_eq!(report.warnings.len(), 1);
    }
}
