//! Curves and points as rays see them.

use kilauea_math::{DAffine3, DMat4, DVec3};
use kilauea_mesh::CurveType;
use kilauea_scene::LightShape;
use kilauea_tests::{
    Curves, Points, Stage, black_emitter, check_near, light, matte, orthographic, perspective,
};
use std::f64::consts::PI;

const STRAIGHT: [[f32; 3]; 4] = [
    [-2.0, 0.0, 0.0],
    [-0.7, 0.0, 0.0],
    [0.7, 0.0, 0.0],
    [2.0, 0.0, 0.0],
];

/// A window from -1 to 1 along x and z, seen from above, in which all that is there shines with 1.
fn window() -> Stage {
    let mut stage = Stage::new(orthographic([0.0, 3.0, 0.0], [0.0, 0.0, 0.0], 1.0));
    stage.materials = vec![black_emitter(1.0)];
    stage
}

/// The part of the window that is covered.
fn covered(stage: &Stage) -> f64 {
    stage.render(|s| s.resolution = [32, 32]).mean()
}

#[test]
fn tubes_cover_their_width() {
    for curve_type in [CurveType::Linear, CurveType::Cubic] {
        let mut stage = window();
        stage.curves = vec![Curves::new(curve_type, &STRAIGHT, 0.5)];
        check_near(covered(&stage), 0.25, 0.01, &format!("{curve_type:?}"));
    }
}

#[test]
fn ribbons_lie_across_their_normals() {
    let mut stage = window();
    let mut ribbon = Curves::new(CurveType::Cubic, &STRAIGHT, 1.0);
    // Tilted by 60 degrees about its axis, it looks half as wide.
    ribbon.normal = Some([0.0, 0.5, 0.75_f32.sqrt()]);
    stage.curves = vec![ribbon];
    let picture = stage.render(|s| s.resolution = [32, 32]);
    check_near(picture.mean(), 0.25, 0.01, "coverage");
    let (n, alpha) = (picture.mean_of("N.Y"), picture.mean_of("A"));
    check_near(n / alpha, 0.5, 0.01, "normal");
}

#[test]
fn points_cover_their_discs() {
    let mut stage = window();
    let mut points = Points::new(&[[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]], 0.5);
    points.widths[1] = 1.0;
    stage.points = vec![points];
    let discs = PI * (0.25_f64.powi(2) + 0.5_f64.powi(2));
    check_near(covered(&stage), discs / 4.0, 0.01, "discs");
}

#[test]
fn uneven_instances_of_spheres_are_ellipsoids() {
    let mut stage = window();
    stage.prototypes.push("/Prototype".into());
    let mut sphere = Points::new(&[[0.0; 3]], 1.0);
    sphere.prototype = 1;
    stage.points = vec![sphere];
    let wide = DAffine3::from_scale(DVec3::new(1.5, 1.0, 0.5));
    stage.instances = vec![kilauea_tests::Placements {
        parent: 0,
        prototype: 1,
        // A second one outside of the window keeps the first an instance.
        parent_from_prototype: vec![wide, DAffine3::from_translation(DVec3::X * 50.0)],
        primvar: None,
        later: Vec::new(),
    }];
    check_near(covered(&stage), PI * 0.75 * 0.25 / 4.0, 0.01, "ellipse");
}

/// White surfaces under a white sky must be as bright as the sky: what leaks or shadows itself
/// shows. Convex shapes alone, or light that bounces between them would be cut off.
#[test]
fn white_shapes_vanish_in_a_white_sky() {
    for offset in [0.0, 1e4] {
        let mut stage = Stage::new(perspective([offset, 1.0, 4.0], [offset, 0.0, 0.0], 0.4));
        stage.materials = vec![matte([1.0; 3])];
        stage.lights.push(light(LightShape::Dome, DMat4::IDENTITY));
        let at = DAffine3::from_translation(DVec3::X * offset);
        let mut points = Points::new(&[[-1.0, 0.5, 0.0], [1.0, 0.5, 0.0]], 0.5);
        points.prototype_from_points = at;
        stage.points = vec![points];
        let mut curve = Curves::new(
            CurveType::Linear,
            &[[-1.5, -0.5, 0.0], [1.5, -0.5, 0.0]],
            0.3,
        );
        curve.world_from_curves = at;
        stage.curves = vec![curve];
        let picture = stage.render(|s| {
            s.resolution = [32, 32];
            s.max_depth = 64;
        });
        check_near(picture.mean(), 1.0, 2e-3, &format!("at {offset}"));
        assert!(picture.mean_of("A") > 0.1);
    }
}
