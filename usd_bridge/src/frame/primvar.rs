use kilauea_mesh as mesh;
use pyo3::prelude::*;

use super::arrays::{Floats, Ints, slice, token};

#[derive(FromPyObject)]
pub(crate) struct Primvar<'py> {
    name: String,
    width: u8,
    interpolation: String,
    values: Floats<'py>,
    indices: Option<Ints<'py>>,
}

impl Primvar<'_> {
    pub(super) fn payload<'a>(&'a self, path: &str) -> PyResult<mesh::Primvar<'a>> {
        let attribute = || format!("primvars:{}", self.name);
        Ok(mesh::Primvar {
            name: &self.name,
            width: self.width,
            interpolation: token(&self.interpolation, path)?,
            values: slice(&self.values, path, &attribute())?,
            indices: self
                .indices
                .as_ref()
                .map(|i| slice(i, path, &attribute()))
                .transpose()?,
        })
    }
}

pub(super) fn primvars<'a>(
    primvars: &'a [Primvar<'_>],
    path: &str,
) -> PyResult<Vec<mesh::Primvar<'a>>> {
    primvars.iter().map(|p| p.payload(path)).collect()
}

pub(super) fn optional<'a>(
    primvar: Option<&'a Primvar<'_>>,
    path: &str,
) -> PyResult<Option<mesh::Primvar<'a>>> {
    primvar.map(|p| p.payload(path)).transpose()
}
