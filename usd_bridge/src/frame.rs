//! Reads `kilauea.payload` records; arrays are borrowed from NumPy.

use kilauea_math::{DAffine3, DMat4};
use kilauea_mesh as mesh;
use kilauea_scene::Visibility;
use numpy::{Element, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use serde::de::DeserializeOwned;
use std::str::FromStr;

use crate::error::scene_error;

type Floats<'py> = PyReadonlyArrayDyn<'py, f32>;
type Ints<'py> = PyReadonlyArrayDyn<'py, i32>;

#[derive(FromPyObject)]
pub(crate) struct Primvar<'py> {
    name: String,
    width: u8,
    interpolation: String,
    values: Floats<'py>,
    indices: Option<Ints<'py>>,
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

#[derive(FromPyObject)]
pub(crate) struct Instances<'py> {
    path: String,
    parent: u32,
    prototype: u32,
    parent_from_prototype: PyReadonlyArrayDyn<'py, f64>,
    primvars: Vec<Primvar<'py>>,
    later_parent_from_prototype: Vec<PyReadonlyArrayDyn<'py, f64>>,
    visibility: u8,
}

/// One flattened frame; see `kilauea/payload.py`.
#[derive(FromPyObject)]
pub(crate) struct Frame<'py> {
    prototypes: Vec<String>,
    meshes: Vec<Mesh<'py>>,
    implicits: Vec<Implicit<'py>>,
    curves: Vec<Curves<'py>>,
    points: Vec<Points<'py>>,
    instances: Vec<Instances<'py>>,
    materials: Bound<'py, PyAny>,
    textures: Bound<'py, PyAny>,
    lights: Bound<'py, PyAny>,
    camera: Bound<'py, PyAny>,
}

impl Frame<'_> {
    /// The same frame in the engine's terms, borrowing the arrays.
    pub(crate) fn payloads(&self) -> PyResult<mesh::Payloads<'_>> {
        Ok(mesh::Payloads {
            prototypes: self.prototypes.clone(),
            meshes: self
                .meshes
                .iter()
                .map(Mesh::payload)
                .collect::<PyResult<_>>()?,
            implicits: self
                .implicits
                .iter()
                .map(Implicit::payload)
                .collect::<PyResult<_>>()?,
            curves: self
                .curves
                .iter()
                .map(Curves::payload)
                .collect::<PyResult<_>>()?,
            points: self
                .points
                .iter()
                .map(Points::payload)
                .collect::<PyResult<_>>()?,
            instances: self
                .instances
                .iter()
                .map(Instances::payload)
                .collect::<PyResult<_>>()?,
            materials: records(&self.materials, "materials")?,
            textures: records(&self.textures, "textures")?,
            lights: records(&self.lights, "lights")?,
            camera: records(&self.camera, "camera")?,
        })
    }
}

impl Primvar<'_> {
    fn payload<'a>(&'a self, path: &str) -> PyResult<mesh::Primvar<'a>> {
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

impl Mesh<'_> {
    fn payload(&self) -> PyResult<mesh::PolyMesh<'_>> {
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

impl Implicit<'_> {
    fn payload(&self) -> PyResult<mesh::ImplicitShape<'_>> {
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
    fn payload(&self) -> PyResult<mesh::BasisCurves<'_>> {
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
    fn payload(&self) -> PyResult<mesh::Points<'_>> {
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

impl Instances<'_> {
    fn payload(&self) -> PyResult<mesh::InstancesPayload<'_>> {
        let path = self.path.as_str();
        let later = self.later_parent_from_prototype.iter();
        Ok(mesh::InstancesPayload {
            path,
            parent: self.parent,
            prototype: self.prototype,
            parent_from_prototype: affines(&self.parent_from_prototype, path)?,
            later_parent_from_prototype: later
                .map(|key| affines(key, path))
                .collect::<PyResult<_>>()?,
            primvars: primvars(&self.primvars, path)?,
            visibility: Visibility(self.visibility),
        })
    }
}

fn primvars<'a>(primvars: &'a [Primvar<'_>], path: &str) -> PyResult<Vec<mesh::Primvar<'a>>> {
    primvars.iter().map(|p| p.payload(path)).collect()
}

fn optional<'a>(
    primvar: Option<&'a Primvar<'_>>,
    path: &str,
) -> PyResult<Option<mesh::Primvar<'a>>> {
    primvar.map(|p| p.payload(path)).transpose()
}

fn triples<'a>(points: &'a Floats<'_>, path: &str) -> PyResult<&'a [[f32; 3]]> {
    let (points, rest) = slice(points, path, "points")?.as_chunks::<3>();
    if rest.is_empty() {
        return Ok(points);
    }
    let what = format!("{path}: points is not an array of triples");
    Err(scene_error(what))
}

fn later_points<'a>(keys: &'a [Floats<'_>], path: &str) -> PyResult<Vec<&'a [[f32; 3]]>> {
    keys.iter().map(|key| triples(key, path)).collect()
}

fn affines(matrices: &PyReadonlyArrayDyn<'_, f64>, path: &str) -> PyResult<Vec<DAffine3>> {
    let numbers = slice(matrices, path, "instance transforms")?;
    Ok(numbers.as_chunks::<16>().0.iter().map(affine).collect())
}

/// USD's row vectors, row after row, are column vectors, column after column.
fn affine(m: &[f64; 16]) -> DAffine3 {
    DAffine3::from_mat4(DMat4::from_cols_array(m))
}

fn slice<'a, T: Element>(
    array: &'a PyReadonlyArrayDyn<'_, T>,
    path: &str,
    attribute: &str,
) -> PyResult<&'a [T]> {
    array
        .as_slice()
        .map_err(|error| scene_error(format!("{path}: {attribute}: {error}")))
}

fn token<T: FromStr<Err: std::fmt::Display>>(text: &str, path: &str) -> PyResult<T> {
    text.parse()
        .map_err(|error| scene_error(format!("{path}: {error}")))
}

/// Control records cross as JSON: they are few, and serde's messages name what is wrong.
fn records<T: DeserializeOwned>(value: &Bound<'_, PyAny>, what: &str) -> PyResult<T> {
    let json = value.py().import("json")?;
    let text: String = json.call_method1("dumps", (value,))?.extract()?;
    serde_json::from_str(&text).map_err(|error| scene_error(format!("{what}: {error}")))
}
