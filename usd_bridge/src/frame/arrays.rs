use kilauea_math::{DAffine3, DMat4};
use numpy::{Element, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use std::str::FromStr;

use crate::error::scene_error;

pub(super) type Floats<'py> = PyReadonlyArrayDyn<'py, f32>;
pub(super) type Ints<'py> = PyReadonlyArrayDyn<'py, i32>;

pub(super) fn triples<'a>(points: &'a Floats<'_>, path: &str) -> PyResult<&'a [[f32; 3]]> {
    let (points, rest) = slice(points, path, "points")?.as_chunks::<3>();
    if rest.is_empty() {
        return Ok(points);
    }
    let what = format!("{path}: points is not an array of triples");
    Err(scene_error(what))
}

pub(super) fn later_points<'a>(
    keys: &'a [Floats<'_>],
    path: &str,
) -> PyResult<Vec<&'a [[f32; 3]]>> {
    keys.iter().map(|key| triples(key, path)).collect()
}

pub(super) fn affines(
    matrices: &PyReadonlyArrayDyn<'_, f64>,
    path: &str,
) -> PyResult<Vec<DAffine3>> {
    let numbers = slice(matrices, path, "instance transforms")?;
    Ok(numbers.as_chunks::<16>().0.iter().map(affine).collect())
}

/// USD's row vectors, row after row, are column vectors, column after column.
pub(super) fn affine(m: &[f64; 16]) -> DAffine3 {
    DAffine3::from_mat4(DMat4::from_cols_array(m))
}

pub(super) fn slice<'a, T: Element>(
    array: &'a PyReadonlyArrayDyn<'_, T>,
    path: &str,
    attribute: &str,
) -> PyResult<&'a [T]> {
    array
        .as_slice()
        .map_err(|error| scene_error(format!("{path}: {attribute}: {error}")))
}

pub(super) fn token<T: FromStr<Err: std::fmt::Display>>(text: &str, path: &str) -> PyResult<T> {
    text.parse()
        .map_err(|error| scene_error(format!("{path}: {error}")))
}
