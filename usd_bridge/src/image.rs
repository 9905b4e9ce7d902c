use kilauea_film::read_exr;
use numpy::ndarray::{Array2, ArrayView3};
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray3};
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

/// The HDR-FLIP of each pixel, (height, width), of two arrays (height, width, 3) of linear Rec. 709.
#[pyfunction]
pub(crate) fn hdr_flip<'py>(
    py: Python<'py>,
    image: PyReadonlyArray3<'py, f32>,
    reference: PyReadonlyArray3<'py, f32>,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let (height, width, channels) = image.as_array().dim();
    if image.as_array().dim() != reference.as_array().dim() || channels != 3 {
        return Err(render_error(format!(
            "images of {:?} and {:?} values cannot be compared",
            image.as_array().shape(),
            reference.as_array().shape()
        )));
    }
    let (image, reference) = (pixels(image.as_array()), pixels(reference.as_array()));
    let errors = py.detach(|| kilauea_film::hdr_flip(&image, &reference, [width, height]));
    let errors = Array2::from_shape_vec((height, width), errors).map_err(render_error)?;
    Ok(errors.into_pyarray(py))
}

fn pixels(image: ArrayView3<'_, f32>) -> Vec<[f32; 3]> {
    image
        .rows()
        .into_iter()
        .map(|rgb| [rgb[0], rgb[1], rgb[2]])
        .collect()
}
