//! What is damaged: a scene with all kinds of geometry, and a frame of it.

use kilauea_math::{DAffine3, DMat4, DVec3, Spectrum};
use kilauea_mesh::CurveType;
use kilauea_scene::{Light, LightShape, RenderSettings, Scene};
use kilauea_tests::{Curves, Mesh, Placements, Points, Stage, glass, light, rect_light};

/// A frame of two tiles and three passes.
pub(crate) fn settings() -> RenderSettings {
    RenderSettings {
        resolution: [40, 8],
        samples_per_pixel: 4,
        ..Stage::settings()
    }
}

/// Meshes, an instance, hair, a ball of points, two lights, two materials.
pub(crate) fn scene() -> Scene {
    let mut stage = Stage::sphere_on_floor();
    stage.materials.push(glass(&[]));
    stage.prototypes.push("/Prototype".into());
    let small = DAffine3::from_scale(DVec3::splat(0.15));
    stage
        .meshes
        .push(Mesh::cube().in_prototype(1).with_material(2).placed(small));
    stage.instances.push(Placements {
        parent: 0,
        prototype: 1,
        parent_from_prototype: vec![DAffine3::from_translation(DVec3::new(0.2, 0.2, 0.9))],
        primvar: None,
        later: Vec::new(),
    });
    let strand = [[-0.9, 0.0, 0.2], [-0.8, 0.5, 0.3], [-0.9, 1.0, 0.1]];
    stage
        .curves
        .push(Curves::new(CurveType::Cubic, &strand, 0.05));
    stage.points.push(Points::new(&[[0.5, 0.2, 0.9]], 0.15));
    stage.lights.push(rect_light(0.5, 0.5, 2.0));
    stage.lights.push(Light {
        radiance: Spectrum::new(0.1, 0.2, 0.3),
        ..light(LightShape::Dome, DMat4::IDENTITY)
    });
    stage.scene(settings().resolution)
}
