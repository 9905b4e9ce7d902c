use kilauea_scene::{CurvesChunk, MeshChunk, PointsChunk, Prototype, Scene};

use crate::geometry::ChunkId;

/// The scene with husks in the place of the chunks that are not kept, by chunk and material. All
/// numbers stay what they are.
pub(super) fn cut(scene: &Scene, keep: impl Fn(ChunkId, u32) -> bool) -> Scene {
    let prototypes = (0..).zip(&scene.prototypes).map(|(prototype, whole)| {
        let n_meshes = whole.chunks.len() as u32;
        let n_before_curves = n_meshes + whole.points.len() as u32;
        let keep = |chunk, material| keep(ChunkId { prototype, chunk }, material);
        let meshes = (0..).zip(&whole.chunks);
        let points = (n_meshes..).zip(&whole.points);
        let curves = (n_before_curves..).zip(&whole.curves);
        Prototype {
            path: whole.path.clone(),
            center: whole.center,
            chunks: meshes
                .map(|(i, c)| whole_or_husk(c, keep(i, c.material), MeshChunk::husk))
                .collect(),
            curves: curves
                .map(|(i, c)| whole_or_husk(c, keep(i, c.material), CurvesChunk::husk))
                .collect(),
            points: points
                .map(|(i, c)| whole_or_husk(c, keep(i, c.material), PointsChunk::husk))
                .collect(),
            instances: whole.instances.clone(),
        }
    });
    Scene {
        origin_world: scene.origin_world,
        prim_paths: scene.prim_paths.clone(),
        prototypes: prototypes.collect(),
        materials: scene.materials.clone(),
        textures: scene.textures.clone(),
        lights: scene.lights.clone(),
        camera: scene.camera.clone(),
    }
}

fn whole_or_husk<T: Clone>(chunk: &T, is_kept: bool, husk: impl Fn(&T) -> T) -> T {
    if is_kept { chunk.clone() } else { husk(chunk) }
}
