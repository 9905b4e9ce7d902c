//! White convex solids under a white sky, which are as bright as the sky.
//!
//! On a flat white face half of the light comes from the sample of the sky and half from the ray
//! that is scattered, whatever their directions, so that every single sample is one. A ray that
//! meets what it left, or misses the solid behind it, shows at once.

use kilauea_math::{DAffine3, DMat4};
use kilauea_scene::{Camera, LightShape};
use kilauea_tests::{Mesh, Picture, Placements, Stage, light, matte};

/// No solids yet: a white sky and one white material.
pub(crate) fn stage(camera: Camera) -> Stage {
    let mut stage = Stage::new(camera);
    stage.materials = vec![matte([1.0; 3])];
    stage.lights.push(light(LightShape::Dome, DMat4::IDENTITY));
    stage
}

/// Adds instances of a mesh.
pub(crate) fn place(stage: &mut Stage, mesh: Mesh, places: Vec<DAffine3>) {
    let prototype = stage.prototypes.len() as u32;
    stage.prototypes.push(format!("/Prototype{prototype}"));
    stage.meshes.push(mesh.in_prototype(prototype));
    stage.instances.push(Placements {
        parent: 0,
        prototype,
        parent_from_prototype: places,
        primvar: None,
        later: Vec::new(),
    });
}

/// Fails where a value is further than `tolerance` from one, or solids cover less than a fraction
/// of the picture. Returns the largest difference.
pub(crate) fn check(stage: &Stage, cover: f64, tolerance: f32, what: &str) -> f32 {
    let picture = stage.render(|s| {
        s.resolution = [24, 24];
        s.samples_per_pixel = 16;
    });
    let covered = picture.mean_of("A");
    assert!(covered >= cover, "{what}: covers {covered}");
    check_white(&picture, tolerance, what)
}

fn check_white(picture: &Picture, tolerance: f32, what: &str) -> f32 {
    picture.check_finite(what);
    let channels = ["R", "G", "B"].map(|c| picture.channel(c));
    let most = channels
        .iter()
        .flat_map(|c| c.iter())
        .map(|v| (v - 1.0).abs())
        .fold(0.0, f32::max);
    assert!(most <= tolerance, "{what}: off by {most:e}");
    most
}
