use kilauea_cluster::{ClusterJob, ClusterOptions, WorkerKind};
use kilauea_scene::RenderSettings;
use pyo3::prelude::*;
use serde::Deserialize;
use std::path::PathBuf;

use crate::error::render_error;
use crate::job::{AnyJob, RenderJob};

/// A scene that workers can be given.
#[pyclass(frozen, module = "kilauea._native")]
pub(crate) struct AssembledScene {
    pub(crate) scene: kilauea_scene::Scene,
    pub(crate) warnings: Vec<String>,
    pub(crate) assemble_secs: f64,
    pub(crate) specialize_rays: bool,
}

/// How a frame is shared out.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Sharing {
    n_workers: u32,
    /// What starts a worker, which then calls `run_worker`.
    command: Vec<String>,
    journal: Option<PathBuf>,
}

#[pymethods]
impl AssembledScene {
    /// What was found wrong and left out.
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    /// Start workers that render; `sharing_json` is an object with `n_workers`, `command`, which is a
    /// list, and `journal`, which is a file or null.
    fn render(
        &self,
        py: Python<'_>,
        settings_json: &str,
        metadata_json: &str,
        sharing_json: &str,
    ) -> PyResult<RenderJob> {
        let settings: RenderSettings = serde_json::from_str(settings_json).map_err(render_error)?;
        let sharing: Sharing = serde_json::from_str(sharing_json).map_err(render_error)?;
        let mut command = sharing.command.into_iter();
        let program = command
            .next()
            .ok_or_else(|| render_error("the command is empty"))?;
        let kind = WorkerKind::Processes {
            program: program.into(),
            arguments: command.map(Into::into).collect(),
        };
        let options = ClusterOptions {
            journal: sharing.journal,
            specialize_rays: self.specialize_rays,
            ..ClusterOptions::new(sharing.n_workers, kind)
        };
        let job = py
            .detach(|| ClusterJob::start(&self.scene, &settings, options))
            .map_err(render_error)?;
        RenderJob::new(AnyJob::Workers(job), &self.scene, &settings, metadata_json)
    }
}

/// Work for the console whose ticket is on standard input, until there is nothing to do.
#[pyfunction]
pub(crate) fn run_worker(py: Python<'_>) -> PyResult<()> {
    py.detach(kilauea_cluster::run_worker).map_err(render_error)
}
