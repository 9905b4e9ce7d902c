use std::sync::{Mutex, PoisonError};

use kilauea_cluster::Ticket;
use pyo3::prelude::*;

use crate::error::render_error;

/// A render node within this process. It keeps the scene of its last frame.
#[pyclass(frozen, module = "kilauea._native")]
#[derive(Default)]
pub(crate) struct Worker(Mutex<kilauea_cluster::Worker>);

#[pymethods]
impl Worker {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Work for the console that a ticket names, a line of JSON, until there is nothing to do.
    fn work(&self, py: Python<'_>, ticket_json: &str) -> PyResult<()> {
        let ticket: Ticket = serde_json::from_str(ticket_json).map_err(render_error)?;
        let work = || {
            let mut worker = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            worker.work_for(&ticket)
        };
        py.detach(work).map_err(render_error)
    }
}

/// Work for the consoles whose tickets are on standard input, one after the other.
#[pyfunction]
pub(crate) fn run_worker(py: Python<'_>) -> PyResult<()> {
    py.detach(kilauea_cluster::run_worker).map_err(render_error)
}
