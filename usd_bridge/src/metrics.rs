use pyo3::prelude::*;

use crate::error::render_error;
use crate::job::{AnyJob, RenderJob};

/// A page of figures for Prometheus, at `http://ADDRESS/metrics`, for as long as this is there.
#[pyclass(frozen, module = "kilauea._native")]
pub(crate) struct MetricsServer(kilauea_cluster::MetricsServer);

#[pymethods]
impl MetricsServer {
    /// Listen at an address, as `127.0.0.1:9100`.
    #[new]
    fn new(address: &str) -> PyResult<Self> {
        let bound = kilauea_cluster::MetricsServer::bind(address);
        bound
            .map(Self)
            .map_err(|error| render_error(format!("--metrics {address}: {error}")))
    }

    /// Where it listens.
    #[getter]
    fn address(&self) -> String {
        self.0.address().to_string()
    }

    /// Show a frame that workers render; other frames have nothing to show.
    fn watch(&self, job: &RenderJob) -> PyResult<()> {
        job.with_job(|job| match job {
            AnyJob::Threads(_) => {}
            AnyJob::Workers(job) => self.0.watch(job),
        })
    }
}
