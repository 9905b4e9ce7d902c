use kilauea_mesh as mesh;
use kilauea_scene::Visibility;
use pyo3::prelude::*;

use super::arrays::{Floats, Ints, affine, later_points, slice, token, triples};
use super::primvar::{Primvar, optional, primvars};

#[derive(FromPyObject)]
pub(crate) struct Implicit<'py> {
    path: String,
    prototype: u32,
    prototype_from_mesh: [f64; 16],
    kind: String,
    axis: String,
    dimensions: [f64; 3],
    material: u32,
    left_handed: bool,
    double_sided: bool,
    primvars: Vec<Primvar<'py>>,
    visibility: u8,
}

#[derive(FromPyObject)]
#[expect(
    clippy::struct_field_names,
    reason = "fields are named as in payload.py"
)]
pub(crate) struct Curves<'py> {
    path: String,
    prototype: u32,
    prototype_from_curves: [f64; 16],
    points: Floats<'py>,
    curve_vertex_counts: Ints<'py>,
    curve_type: String,
    basis: String,
    wrap: String,
    material: u32,
    widths: Option<Primvar<'py>>,
    normals: Option<Primvar<'py>>,
    primvars: Vec<Primvar<'py>>,
    later_points: Vec<Floats<'py>>,
    visibility: u8,
}

#[derive(FromPyObject)]
#[expect(
    clippy::struct_field_names,
    reason = "fields are named as in payload.py"
)]
pub(crate) struct Points<'py> {
    path: String,
    prototype: u32,
    prototype_from_points: [f64; 16],
    points: Floats<'py>,
    material: u32,
    widths: Option<Primvar<'py>>,
    primvars: Vec<Primvar<'py>>,
    later_points: Vec<Floats<'py>>,
    visibility: u8,
}

impl Implicit<'_> {
    pub(super) fn payload(&self) -> PyResult<mesh::ImplicitShape<'_>> {
        Ok(mesh::ImplicitShape {
            path: &self.path,
            prototype: self.prototype,
            prototype_from_mesh: affine(&self.prototype_from_mesh),
            kind: token(&self.kind, &self.path)?,
            axis: token(&self.axis, &self.path)?,
            dimensions: self.dimensions,
            material: self.material,
            left_handed: self.left_handed,
            double_sided: self.double_sided,
            primvars: primvars(&self.primvars, &self.path)?,
            visibility: Visibility(self.visibility),
        })
    }
}

impl Curves<'_> {
    pub(super) fn payload(&self) -> PyResult<mesh::BasisCurves<'_>> {
        let path = self.path.as_str();
        Ok(mesh::BasisCurves {
            path,
            prototype: self.prototype,
            prototype_from_curves: affine(&self.prototype_from_curves),
            points: triples(&self.points, path)?,
            later_points: later_points(&self.later_points, path)?,
            curve_vertex_counts: slice(&self.curve_vertex_counts, path, "curveVertexCounts")?,
            curve_type: token(&self.curve_type, path)?,
            basis: token(&self.basis, path)?,
            wrap: token(&self.wrap, path)?,
            widths: optional(self.widths.as_ref(), path)?,
            normals: optional(self.normals.as_ref(), path)?,
            primvars: primvars(&self.primvars, path)?,
            material: self.material,
            visibility: Visibility(self.visibility),
        })
    }
}

impl Points<'_> {
    pub(super) fn payload(&self) -> PyResult<mesh::Points<'_>> {
        let path = self.path.as_str();
        Ok(mesh::Points {
            path,
            prototype: self.prototype,
            prototype_from_points: affine(&self.prototype_from_points),
            points: triples(&self.points, path)?,
            later_points: later_points(&self.later_points, path)?,
            widths: optional(self.widths.as_ref(), path)?,
            primvars: primvars(&self.primvars, path)?,
            material: self.material,
            visibility: Visibility(self.visibility),
        })
    }
}
