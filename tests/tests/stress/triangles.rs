//! Triangles that are hardly any, or none.

use kilauea_math::{DAffine3, DVec3};
use kilauea_tests::{Mesh, Picture, Stage, orthographic, rect_light};

use super::white;

/// A glossy sphere on a floor.
fn sound() -> Stage {
    let mut stage = Stage::sphere_on_floor();
    stage.lights.push(rect_light(1.0, 1.0, 2.0));
    stage
}

fn render(stage: &Stage) -> (Picture, Vec<String>) {
    stage.render_damaged(|s| {
        s.resolution = [32, 32];
        s.samples_per_pixel = 8;
    })
}

/// Adds a triangle to the floor.
fn add_triangle(stage: &mut Stage, corners: [[f32; 3]; 3]) {
    let mesh = &mut stage.meshes[0];
    let first = mesh.points.len() as i32;
    mesh.points.extend(corners);
    mesh.counts.push(3);
    mesh.indices.extend(first..first + 3);
}

/// The picture must be that of the sound stage, and the warning must say what is left out.
fn check_left_out(triangles: &[[[f32; 3]; 3]], words: &[&str]) {
    let (expected, warnings) = render(&sound());
    assert_eq!(warnings, [""; 0]);
    let mut stage = sound();
    stage.meshes[0].path = "/World/Floor".into();
    for corners in triangles {
        add_triangle(&mut stage, *corners);
    }
    let (picture, warnings) = render(&stage);
    expected.check_same_bits(&picture, &warnings.join("; "));
    let is_said = |w: &String| words.iter().all(|word| w.contains(word));
    assert!(warnings.iter().any(is_said), "{words:?}: {warnings:?}");
    super::report("triangles", words.join(" "), triangles.len());
}

#[test]
fn triangles_without_area_are_counted_by_prim() {
    let line = [[-1.0, 0.5, 0.0], [0.0, 0.5, 0.0], [1.0, 0.5, 0.0]];
    let corner = [[0.2, 0.7, 0.1]; 3];
    check_left_out(&[line, corner, line], &["/World/Floor 3", "without area"]);
}

#[test]
fn triangles_of_no_numbers_are_counted_by_prim() {
    let with = |x: f32| [[x, 0.5, 0.0], [0.0, 0.5, 1.0], [1.0, 0.5, 0.0]];
    check_left_out(
        &[with(f32::NAN), with(f32::INFINITY), with(f32::NEG_INFINITY)],
        &["/World/Floor", "3 points are not finite", "3 triangles"],
    );
}

#[test]
fn triangles_beyond_all_bounds_are_counted_by_prim() {
    let huge = [[1e30, 0.5, 0.0], [0.0, 0.5, 1e30], [-1e30, 0.5, 0.0]];
    let mut stage = sound();
    stage.meshes[0].path = "/World/Floor".into();
    add_triangle(&mut stage, huge);
    let (picture, warnings) = render(&stage);
    picture.check_finite("huge");
    let is_said = |w: &String| w.contains("/World/Floor");
    assert!(warnings.iter().any(is_said), "{warnings:?}");
}

#[test]
fn triangles_that_are_there_twice_change_nothing() {
    let (expected, _) = render(&sound());
    let mut stage = sound();
    let mesh = &mut stage.meshes[0];
    for _ in 0..3 {
        mesh.counts.push(4);
        mesh.indices.extend(0..4);
    }
    let (picture, warnings) = render(&stage);
    assert_eq!(warnings, [""; 0]);
    expected.check_same_bits(&picture, "the floor four times");
}

/// A square rod along x.
fn rod(width: f64) -> Mesh {
    let half = DVec3::new(1.0, 0.5 * width, 0.5 * width);
    Mesh::cube().placed(
        DAffine3::from_rotation_z(0.3)
            * DAffine3::from_rotation_x(0.4)
            * DAffine3::from_scale(half),
    )
}

/// A white sky with a rod across, as thick as half of the picture is wide.
fn sky_with_rod(width: f64) -> Stage {
    let mut stage = white::stage(orthographic([0.0, 0.0, 2.0], [0.0; 3], width));
    stage.meshes.push(rod(width));
    stage
}

#[test]
fn rods_vanish_in_a_white_sky() {
    for exponent in [-1, -2, -3] {
        let width = 10.0_f64.powi(exponent);
        let most = white::check(&sky_with_rod(width), 0.3, 1e-5, &format!("1e{exponent}"));
        super::report("triangles", format!("rod 1e{exponent} wide, off by"), most);
    }
}

/// Where f32 has three digits across a triangle, a path as close as that to its edge may start
/// behind the next triangle, and is lost.
#[test]
fn needles_lose_little_of_a_white_sky() {
    for (exponent, most_lost) in [(-4, 1e-3), (-5, 1e-2), (-6, 0.2)] {
        let picture = sky_with_rod(10.0_f64.powi(exponent)).render(|s| s.resolution = [24, 24]);
        picture.check_finite("needle");
        let covered = picture.mean_of("A");
        assert!(covered > 0.3, "covers {covered}");
        let lost = (1.0 - picture.mean()) / covered;
        super::report(
            "triangles",
            format!("rod 1e{exponent} wide, share lost"),
            lost,
        );
        assert!(lost.abs() < most_lost, "1e{exponent}: {lost}");
    }
}
