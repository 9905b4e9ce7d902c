use kilauea_mesh as mesh;
use kilauea_scene::Visibility;
use pyo3::prelude::*;

use super::arrays::{Floats, Ints, affine, slice, token, triples};
use super::primvar::{Primvar, optional, primvars};

#[derive(FromPyObject)]
#[expect(
    clippy::struct_field_names,
    reason = "fields are named as in payload.py"
)]
pub(crate) struct Mesh<'py> {
    path: String,
    prototype: u32,
    prototype_from_mesh: [f64; 16],
    points: Floats<'py>,
    face_vertex_counts: Ints<'py>,
    face_vertex_indices: Ints<'py>,
    material: u32,
    hole_indices: Option<Ints<'py>>,
    left_handed: bool,
    double_sided: bool,
    normals: Option<Primvar<'py>>,
    primvars: Vec<Primvar<'py>>,
    subsets: Vec<Subset<'py>>,
    subdivision: Option<Subdivision<'py>>,
    later_keys: Vec<MeshKey<'py>>,
    visibility: u8,
}

#[derive(FromPyObject)]
pub(crate) struct MeshKey<'py> {
    points: Floats<'py>,
    normals: Option<Primvar<'py>>,
}

#[derive(FromPyObject)]
pub(crate) struct Subset<'py> {
    faces: Ints<'py>,
    material: u32,
}

#[derive(FromPyObject)]
pub(crate) struct Subdivision<'py> {
    scheme: String,
    interpolate_boundary: String,
    face_varying_linear_interpolation: String,
    triangle_subdivision_rule: String,
    crease_indices: Ints<'py>,
    crease_lengths: Ints<'py>,
    crease_sharpnesses: Floats<'py>,
    corner_indices: Ints<'py>,
    corner_sharpnesses: Floats<'py>,
}

impl Mesh<'_> {
    pub(super) fn payload(&self) -> PyResult<mesh::PolyMesh<'_>> {
        let path = self.path.as_str();
        let subsets = self.subsets.iter().map(|s| {
            Ok(mesh::Subset {
                faces: slice(&s.faces, path, "GeomSubset indices")?,
                material: s.material,
            })
        });
        Ok(mesh::PolyMesh {
            path,
            prototype: self.prototype,
            prototype_from_mesh: affine(&self.prototype_from_mesh),
            points: triples(&self.points, path)?,
            face_vertex_counts: slice(&self.face_vertex_counts, path, "faceVertexCounts")?,
            face_vertex_indices: slice(&self.face_vertex_indices, path, "faceVertexIndices")?,
            hole_indices: match &self.hole_indices {
                Some(holes) => slice(holes, path, "holeIndices")?,
                None => &[],
            },
            left_handed: self.left_handed,
            double_sided: self.double_sided,
            normals: optional(self.normals.as_ref(), path)?,
            primvars: primvars(&self.primvars, path)?,
            subdivision: self
                .subdivision
                .as_ref()
                .map(|s| s.payload(path))
                .transpose()?,
            material: self.material,
            subsets: subsets.collect::<PyResult<_>>()?,
            later_keys: self
                .later_keys
                .iter()
                .map(|key| key.payload(path))
                .collect::<PyResult<_>>()?,
            visibility: Visibility(self.visibility),
        })
    }
}

impl MeshKey<'_> {
    fn payload<'a>(&'a self, path: &str) -> PyResult<mesh::MeshPose<'a>> {
        Ok(mesh::MeshPose {
            points: triples(&self.points, path)?,
            normals: optional(self.normals.as_ref(), path)?,
        })
    }
}

impl Subdivision<'_> {
    fn payload<'a>(&'a self, path: &str) -> PyResult<mesh::Subdivision<'a>> {
        Ok(mesh::Subdivision {
            scheme: token(&self.scheme, path)?,
            interpolate_boundary: token(&self.interpolate_boundary, path)?,
            face_varying_linear_interpolation: token(
                &self.face_varying_linear_interpolation,
                path,
            )?,
            triangle_rule: token(&self.triangle_subdivision_rule, path)?,
            crease_indices: slice(&self.crease_indices, path, "creaseIndices")?,
            crease_lengths: slice(&self.crease_lengths, path, "creaseLengths")?,
            crease_sharpnesses: slice(&self.crease_sharpnesses, path, "creaseSharpnesses")?,
            corner_indices: slice(&self.corner_indices, path, "cornerIndices")?,
            corner_sharpnesses: slice(&self.corner_sharpnesses, path, "cornerSharpnesses")?,
        })
    }
}
