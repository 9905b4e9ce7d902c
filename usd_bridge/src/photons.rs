use kilauea_render::{
    PhotonReport, PhotonRequest, TracedPhotons, photon_benefit, photon_picture, trace_photons,
};
use kilauea_scene::Shading;
use pyo3::prelude::*;
use serde::Deserialize;
use std::path::PathBuf;

use crate::error::render_error;
use crate::picture::write_pictures;
use crate::scene::Scene;
use crate::threads::n_threads;

/// What Python asks for.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Request {
    resolution: [u32; 2],
    emitted: u32,
    max_depth: u32,
    seed: u32,
    /// 0 is one per core.
    threads: usize,
}

impl Request {
    fn parse(json: &str) -> PyResult<Self> {
        serde_json::from_str(json).map_err(render_error)
    }

    fn photons(&self) -> PhotonRequest {
        PhotonRequest {
            n_emitted: self.emitted,
            max_depth: self.max_depth,
            seed: self.seed,
            n_threads: n_threads(self.threads),
            shading: Shading::Inline,
        }
    }
}

/// Trace photons and build their map; returns a `kilauea_render::PhotonReport` as JSON.
#[pyfunction]
pub(crate) fn measure_photons(
    py: Python<'_>,
    scene: &Bound<'_, Scene>,
    request_json: &str,
) -> PyResult<String> {
    let request = Request::parse(request_json)?.photons();
    let prepared = &scene.get().prepared;
    py.detach(|| {
        let traced = trace_photons(prepared, &request).map_err(render_error)?;
        report(&traced, None)
    })
}

/// Trace photons, write what they light to each output (`.exr` or `.png`), and return a
/// `kilauea_render::PhotonReport` as JSON, with what the image gets of them.
#[pyfunction]
pub(crate) fn inspect_photons(
    py: Python<'_>,
    scene: &Bound<'_, Scene>,
    request_json: &str,
    outputs: Vec<PathBuf>,
) -> PyResult<String> {
    let request = Request::parse(request_json)?;
    let (resolution, photons) = (request.resolution, request.photons());
    let prepared = &scene.get().prepared;
    py.detach(|| {
        let benefit = photon_benefit(prepared, resolution, &photons).map_err(render_error)?;
        let traced = trace_photons(prepared, &photons).map_err(render_error)?;
        let picture = photon_picture(prepared, &traced.photons, resolution, photons.n_threads)
            .map_err(render_error)?;
        write_pictures(&outputs, &picture, prepared)?;
        report(&traced, Some(benefit))
    })
}

fn report(
    traced: &TracedPhotons,
    benefit: Option<kilauea_render::PhotonBenefit>,
) -> PyResult<String> {
    serde_json::to_string(&PhotonReport::of(traced, benefit)).map_err(render_error)
}
