use kilauea_mesh::{AssembleOptions, assemble};
use kilauea_peer::{Embree, MeasureOptions, Shape, Workload, measure, shape};
use pyo3::prelude::*;
use std::path::PathBuf;

use crate::error::{render_error, scene_error};
use crate::frame::Frame;

/// A mesh and the rays that `kilauea bench rays` traces against it.
#[pyclass(frozen, module = "kilauea._native")]
pub(crate) struct RayWorkload(Workload);

#[pymethods]
impl RayWorkload {
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    #[getter]
    fn n_triangles(&self) -> usize {
        self.0.mesh.triangles().len()
    }

    /// Names of the built-in meshes.
    #[staticmethod]
    fn shapes() -> Vec<&'static str> {
        Shape::ALL.map(Shape::name).to_vec()
    }

    /// A built-in mesh with about `n_rays` rays of each kind.
    #[staticmethod]
    fn shape(py: Python<'_>, name: &str, n_rays: usize) -> PyResult<Self> {
        let known = Shape::ALL.into_iter().find(|shape| shape.name() == name);
        let found = known.ok_or_else(|| scene_error(format!("no shape {name}")))?;
        py.detach(|| shape(found, n_rays))
            .map(Self)
            .map_err(scene_error)
    }

    /// All triangles of a `kilauea.payload.Frame`, every instance baked.
    #[staticmethod]
    fn flatten(
        py: Python<'_>,
        name: &str,
        frame: Frame<'_>,
        resolution: [u32; 2],
        max_triangles: usize,
        n_rays: usize,
    ) -> PyResult<Self> {
        let payloads = frame.payloads()?;
        py.detach(|| {
            let options = AssembleOptions {
                resolution,
                ..AssembleOptions::default()
            };
            let scene = assemble(payloads, &options).map_err(scene_error)?.scene;
            Workload::from_scene(name, &scene, max_triangles, n_rays)
                .map(Self)
                .map_err(scene_error)
        })
    }

    /// A mesh file and the ray files that belong to it.
    #[staticmethod]
    fn read(mesh: PathBuf, rays: Vec<PathBuf>) -> PyResult<Self> {
        Workload::read(&mesh, &rays).map(Self).map_err(scene_error)
    }

    /// Write the mesh and the rays into a folder.
    fn dump(&self, folder: PathBuf) -> PyResult<()> {
        self.0.dump(&folder).map_err(render_error)
    }

    /// Trace with our kernels and with Embree in turns, and return the report as JSON.
    fn measure(
        &self,
        py: Python<'_>,
        embree: PathBuf,
        n_rounds: usize,
        build_threads: Vec<usize>,
    ) -> PyResult<String> {
        let options = MeasureOptions {
            n_rounds,
            build_threads,
        };
        py.detach(|| {
            let embree = Embree::load(&embree).map_err(render_error)?;
            let report = measure(&embree, &self.0, &options).map_err(render_error)?;
            serde_json::to_string(&report).map_err(render_error)
        })
    }
}
