//! A scene as bytes: records with their names (MessagePack), and the arrays as they lie in memory.
//!
//! The camera is not in it, so that the same scene seen from elsewhere is the same bytes, nor are
//! images: tile files are read by their paths, so that all processes must see the same files.

mod chunks;
mod error;
mod geometry;
mod read;
mod write;

use kilauea_math::DVec3;
use kilauea_scene::{Camera, Light, Material, Scene, TextureSource};
use serde::{Deserialize, Serialize};

pub(crate) use chunks::{SceneChunks, put_chunk};
pub use error::SceneBytesError;
use read::SceneReader;
use write::SceneWriter;

#[cfg(target_endian = "big")]
compile_error!("arrays cross between processes as they lie in memory, which is little-endian");

/// What a scene has besides geometry.
#[derive(Serialize)]
struct RecordsRef<'a> {
    origin_world: DVec3,
    prim_paths: &'a [String],
    materials: &'a [Material],
    textures: &'a [TextureSource],
    lights: &'a [Light],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Records {
    origin_world: DVec3,
    prim_paths: Vec<String>,
    materials: Vec<Material>,
    textures: Vec<TextureSource>,
    lights: Vec<Light>,
}

/// The bytes of a camera: a record with its names.
pub(crate) fn camera_to_bytes(camera: &Camera) -> Vec<u8> {
    rmp_serde::to_vec_named(camera).expect("a camera can be written")
}

/// The camera of bytes that [`camera_to_bytes`] wrote.
pub(crate) fn camera_from_bytes(bytes: &[u8]) -> Result<Camera, SceneBytesError> {
    Ok(rmp_serde::from_slice(bytes)?)
}

/// The bytes of a scene, apart from its camera.
pub fn scene_to_bytes(scene: &Scene) -> Vec<u8> {
    write(scene).finish().0
}

fn write(scene: &Scene) -> SceneWriter {
    let records = RecordsRef {
        origin_world: scene.origin_world,
        prim_paths: &scene.prim_paths,
        materials: &scene.materials,
        textures: &scene.textures,
        lights: &scene.lights,
    };
    let mut writer = SceneWriter::with_capacity(scene.n_bytes());
    let records = rmp_serde::to_vec_named(&records).expect("records of a scene can be written");
    writer.array(&records);
    writer.list(&scene.prototypes, SceneWriter::prototype);
    writer
}

/// The scene of bytes that [`scene_to_bytes`] wrote, with a camera that stands for none. Nothing is
/// allocated for what bytes promise and do not have; whether indices are inside their arrays is for
/// [`Scene::validate`] to find out.
pub fn scene_from_bytes(bytes: &[u8]) -> Result<Scene, SceneBytesError> {
    let mut reader = SceneReader::new(bytes);
    let records: Vec<u8> = reader.array()?;
    let records: Records = rmp_serde::from_slice(&records)?;
    let scene = Scene {
        prototypes: reader.list(SceneReader::prototype)?,
        origin_world: records.origin_world,
        prim_paths: records.prim_paths,
        materials: records.materials,
        textures: records.textures,
        lights: records.lights,
        camera: Camera::default(),
    };
    reader.finish()?;
    Ok(scene)
}
