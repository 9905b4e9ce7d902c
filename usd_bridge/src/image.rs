use kilauea_film::read_exr;
use pyo3::prelude::*;
use std::path::PathBuf;

use crate::error::render_error;

/// Compare an image with a reference and return the metrics as JSON.
#[pyfunction]
pub(crate) fn compare(py: Python<'_>, image: PathBuf, reference: PathBuf) -> PyResult<String> {
    py.detach(|| {
        let image = read_exr(&image).map_err(render_error)?;
        let reference = read_exr(&reference).map_err(render_error)?;
        let comparison = kilauea_film::compare(&image, &reference).map_err(render_error)?;
        serde_json::to_string(&comparison).map_err(render_error)
    })
}
