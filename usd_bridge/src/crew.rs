use pyo3::prelude::*;

/// Workers that stay between frames, with the scene that they have. They end with it.
#[pyclass(frozen, module = "kilauea._native")]
#[derive(Default)]
pub(crate) struct Crew(pub(crate) kilauea_cluster::Crew);

#[pymethods]
impl Crew {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// How many wait for the next frame.
    #[getter]
    fn n_idle(&self) -> usize {
        self.0.n_idle()
    }
}
