use kilauea_mesh::{AssembleOptions, Payloads, assemble};
use kilauea_render::{PrepareOptions, PreparedScene};
use kilauea_scene::RenderSettings;
use pyo3::prelude::*;
use serde::Deserialize;
use std::sync::Arc;
use std::time::Instant;

use crate::assembled::AssembledScene;
use crate::error::scene_error;
use crate::frame::Frame;
use crate::scene::Scene;

/// What `build_scene` may be told; everything has a default.
#[derive(Deserialize)]
#[serde(default, deny_unknown_fields)]
struct BuildOptions {
    resolution: [u32; 2],
    max_subdivision_level: u32,
    max_chunk_triangles: usize,
    texture_memory_bytes: u64,
    specialize_rays: bool,
}

impl Default for BuildOptions {
    fn default() -> Self {
        let assemble = AssembleOptions::default();
        let settings = RenderSettings::default();
        Self {
            resolution: assemble.resolution,
            max_subdivision_level: assemble.max_subdivision_level,
            max_chunk_triangles: assemble.max_chunk_triangles,
            texture_memory_bytes: settings.texture_memory_bytes,
            specialize_rays: true,
        }
    }
}

/// Build a scene from a `kilauea.payload.Frame`; `options_json` is an object with any of
/// `resolution`, `max_subdivision_level`, `max_chunk_triangles`, `texture_memory_bytes`, `specialize_rays`.
#[pyfunction]
pub(crate) fn build_scene(py: Python<'_>, frame: Frame<'_>, options_json: &str) -> PyResult<Scene> {
    let options: BuildOptions = serde_json::from_str(options_json).map_err(scene_error)?;
    let payloads = frame.payloads()?;
    py.detach(|| {
        let assembled = options.assemble(payloads)?;
        let prepare_options = PrepareOptions {
            texture_memory_bytes: options.texture_memory_bytes,
            specialize_rays: options.specialize_rays,
        };
        let prepared =
            PreparedScene::new(assembled.scene, &prepare_options).map_err(scene_error)?;
        Ok(Scene {
            prepared: Arc::new(prepared),
            warnings: assembled.warnings,
            assemble_secs: assembled.assemble_secs,
        })
    })
}

/// Assemble a scene for workers, which build what it takes to trace it; takes what `build_scene` does.
#[pyfunction]
pub(crate) fn assemble_scene(
    py: Python<'_>,
    frame: Frame<'_>,
    options_json: &str,
) -> PyResult<AssembledScene> {
    let options: BuildOptions = serde_json::from_str(options_json).map_err(scene_error)?;
    let payloads = frame.payloads()?;
    py.detach(|| options.assemble(payloads))
}

impl BuildOptions {
    fn assemble(&self, payloads: Payloads<'_>) -> PyResult<AssembledScene> {
        let start = Instant::now();
        let assemble_options = AssembleOptions {
            max_chunk_triangles: self.max_chunk_triangles,
            resolution: self.resolution,
            max_subdivision_level: self.max_subdivision_level,
            ..AssembleOptions::default()
        };
        let assembled = assemble(payloads, &assemble_options).map_err(scene_error)?;
        Ok(AssembledScene {
            scene: assembled.scene,
            warnings: assembled.warnings,
            assemble_secs: start.elapsed().as_secs_f64(),
            specialize_rays: self.specialize_rays,
        })
    }
}
