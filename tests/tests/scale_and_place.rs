//! A picture does not depend on the unit of length, or on where the world's origin is.
#![allow(clippy::print_stdout, reason = "the figures, with --nocapture")]

use kilauea_math::{DAffine3, DMat4, DVec3, Spectrum};
use kilauea_scene::{Camera, Light};
use kilauea_tests::{Mesh, Picture, Stage, matte, perspective, rect_light, rel_mse};

/// The box of `tests/scenes/box_rect_light.usda`, multiplied and moved.
fn box_stage(scale: f64, center: DVec3) -> Stage {
    let world_from_box =
        DAffine3::from_translation(center) * DAffine3::from_scale(DVec3::splat(scale));
    let camera = perspective([0.0, 1.0, 3.9], [0.0, 1.0, 0.0], 0.343);
    let mut stage = Stage::new(Camera {
        world_from_camera: placed(world_from_box, camera.world_from_camera),
        clipping_range: camera.clipping_range.map(|x| x * scale),
        ..camera
    });
    stage.materials = vec![
        matte([0.73; 3]),
        matte([0.63, 0.06, 0.05]),
        matte([0.12, 0.45, 0.09]),
    ];
    let walls = [
        ([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], 0),
        ([[-1, 2, -1], [1, 2, -1], [1, 2, 1], [-1, 2, 1]], 0),
        ([[-1, 0, -1], [1, 0, -1], [1, 2, -1], [-1, 2, -1]], 0),
        ([[-1, 0, 1], [-1, 0, -1], [-1, 2, -1], [-1, 2, 1]], 1),
        ([[1, 0, -1], [1, 0, 1], [1, 2, 1], [1, 2, -1]], 2),
    ];
    for (corners, material) in walls {
        let points = corners.map(|p| p.map(|x| x as f32));
        stage
            .meshes
            .push(Mesh::polygon(&points).with_material(material));
    }
    let block = |center: DVec3, degrees: f64, half: DVec3| {
        let turned = DAffine3::from_rotation_y(degrees.to_radians());
        let place = DAffine3::from_translation(center) * turned * DAffine3::from_scale(half);
        Mesh::cube().placed(place)
    };
    stage.meshes.extend([
        block(
            DVec3::new(-0.33, 0.6, -0.3),
            18.0,
            DVec3::new(0.3, 0.6, 0.3),
        ),
        block(DVec3::new(0.33, 0.3, 0.35), -17.0, DVec3::splat(0.3)),
    ]);
    for mesh in &mut stage.meshes {
        mesh.prototype_from_mesh = world_from_box * mesh.prototype_from_mesh;
    }
    let lamp = rect_light(0.5 * scale, 0.4 * scale, 1.99);
    let unscaled = DAffine3::from_translation(center);
    let scaled_height = DMat4::from_translation(DVec3::Y * 1.99 * (scale - 1.0));
    stage.lights.push(Light {
        world_from_light: DMat4::from(unscaled) * scaled_height * lamp.world_from_light,
        radiance: Spectrum::new(15.0, 10.5, 6.0),
        ..lamp
    });
    stage
}

/// The camera moves with the box; its axes keep their length.
fn placed(world_from_box: DAffine3, box_from_camera: DMat4) -> DMat4 {
    let eye = world_from_box.transform_point3(box_from_camera.w_axis.truncate());
    DMat4 {
        w_axis: eye.extend(1.0),
        ..box_from_camera
    }
}

fn render(scale: f64, center: DVec3) -> Picture {
    box_stage(scale, center).render(|s| {
        s.resolution = [64, 64];
        s.samples_per_pixel = 16;
    })
}

/// relMSE, and the largest difference of any value.
fn difference(a: &Picture, b: &Picture) -> (f64, f64) {
    let pairs = ["R", "G", "B"].map(|c| a.channel(c).iter().zip(b.channel(c)));
    let most = pairs
        .into_iter()
        .flatten()
        .map(|(a, b)| f64::from((a - b).abs()))
        .fold(0.0, f64::max);
    (rel_mse(a, b), most)
}

#[test]
fn neither_scale_nor_place_changes_the_picture() {
    let reference = render(1.0, DVec3::ZERO);
    assert!(reference.mean() > 0.05);
    let far = DVec3::new(1.0, -1.0, 0.3);
    let scales = [1e-6, 1e-3, 0.1, 3.0, 1e2, 1e4, 1e6];
    let offsets = [1.0, 1e3, 1e5, 1e6, 1e7];
    let scaled = scales.map(|scale| (scale, DVec3::ZERO));
    let moved = offsets.map(|offset| (1.0, offset * far));
    for (scale, center) in scaled.into_iter().chain(moved).chain([(1e3, 1e6 * far)]) {
        let (rel_mse, most) = difference(&render(scale, center), &reference);
        println!("{scale:e} at {center}: relMSE {rel_mse:.2e}, at most {most:.2e}");
        assert!(
            rel_mse < 1e-5 && most < 1e-5,
            "{scale:e} at {center}: relMSE {rel_mse:.2e}, at most {most:.2e}"
        );
    }
    // Multiplying by a power of two rounds nothing.
    assert_eq!(
        difference(&render(1024.0, DVec3::ZERO), &reference),
        (0.0, 0.0)
    );
}
