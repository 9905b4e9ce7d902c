//! Reads `kilauea.payload` records; arrays are borrowed from NumPy.

mod arrays;
mod mesh;
mod primvar;
mod shapes;

use kilauea_mesh as engine;
use kilauea_scene::Visibility;
use numpy::PyReadonlyArrayDyn;
use pyo3::prelude::*;
use serde::de::DeserializeOwned;

use crate::error::scene_error;
use arrays::affines;
use mesh::Mesh;
use primvar::{Primvar, primvars};
use shapes::{Curves, Implicit, Points};

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

impl Frame<'_> {
    /// The same frame in the engine's terms, borrowing the arrays.
    pub(crate) fn payloads(&self) -> PyResult<engine::Payloads<'_>> {
        Ok(engine::Payloads {
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

impl Instances<'_> {
    fn payload(&self) -> PyResult<engine::InstancesPayload<'_>> {
        let path = self.path.as_str();
        let later = self.later_parent_from_prototype.iter();
        Ok(engine::InstancesPayload {
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

/// Control records cross as JSON: they are few, and serde's messages name what is wrong.
fn records<T: DeserializeOwned>(value: &Bound<'_, PyAny>, what: &str) -> PyResult<T> {
    let json = value.py().import("json")?;
    let text: String = json.call_method1("dumps", (value,))?.extract()?;
    serde_json::from_str(&text).map_err(|error| scene_error(format!("{what}: {error}")))
}
