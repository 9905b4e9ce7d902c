use kilauea_cluster::load_estimates_of;
use kilauea_render::{EstimateLayer, EstimateReport, GatherEstimate, estimate_picture};
use kilauea_scene::RenderSettings;
use pyo3::prelude::*;
use serde::Deserialize;
use std::path::PathBuf;
use std::sync::Arc;

use crate::error::render_error;
use crate::picture::write_pictures;
use crate::scene::Scene;
use crate::threads::n_threads;

/// What Python asks for.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Request {
    settings: RenderSettings,
    /// A file of estimates; without one a pilot makes them.
    estimates: Option<PathBuf>,
    /// What the picture is of.
    shown: Option<EstimateLayer>,
}

/// Write what paths are told to each output (`.exr` or `.png`), and return a
/// `kilauea_render::EstimateReport` as JSON, and whether there was anything to write.
#[pyfunction]
pub(crate) fn inspect_estimates(
    py: Python<'_>,
    scene: &Bound<'_, Scene>,
    request_json: &str,
    outputs: Vec<PathBuf>,
) -> PyResult<(String, bool)> {
    let Request {
        settings,
        estimates,
        shown,
    } = serde_json::from_str(request_json).map_err(render_error)?;
    let prepared = &scene.get().prepared;
    py.detach(|| {
        let (resolution, threads) = (settings.resolution, n_threads(settings.threads as usize));
        let estimate = match estimates {
            Some(path) => load_estimates_of(&path, &prepared.scene).map_err(render_error)?,
            None => GatherEstimate::of(Arc::clone(prepared), settings).map_err(render_error)?,
        };
        let picture = estimate_picture(prepared, &estimate, resolution, threads, shown);
        let picture = picture.map_err(render_error)?;
        if let Some(picture) = &picture {
            write_pictures(&outputs, picture, prepared)?;
        }
        let report = EstimateReport::of(prepared, &estimate, picture.as_ref());
        let report = serde_json::to_string(&report).map_err(render_error)?;
        Ok((report, picture.is_some()))
    })
}
