use kilauea_cluster::{ClusterJob, ClusterOptions, SetOptions, WorkerKind};
use kilauea_scene::RenderSettings;
use pyo3::prelude::*;
use serde::Deserialize;
use std::net::IpAddr;
use std::path::PathBuf;

use crate::crew::Crew;
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
struct Sharing {
    n_workers: u32,
    #[serde(flatten)]
    kind: Kind,
    journal: Option<PathBuf>,
    set: Option<SetOptions>,
    #[serde(default)]
    tls: bool,
}

/// Who starts workers.
#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    /// We do, by this command, which then calls `run_worker`.
    Command(Vec<String>),
    /// They are threads of this process.
    Threads,
    /// The caller, who takes tickets from the job, on machines that reach this one at that address.
    Host(IpAddr),
}

impl Kind {
    fn into_workers(self) -> PyResult<WorkerKind> {
        let mut command = match self {
            Self::Host(host) => return Ok(WorkerKind::Elsewhere { host }),
            Self::Threads => return Ok(WorkerKind::Threads),
            Self::Command(command) => command.into_iter(),
        };
        let program = command
            .next()
            .ok_or_else(|| render_error("the command is empty"))?;
        Ok(WorkerKind::Processes {
            program: program.into(),
            arguments: command.map(Into::into).collect(),
        })
    }
}

#[pymethods]
impl AssembledScene {
    /// What was found wrong and left out.
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    /// Have workers render; `sharing_json` is an object with `n_workers`, `journal`, which is a file or
    /// null, `set`, which is a `kilauea_cluster::SetOptions` or null, and one of `command`, a list that
    /// starts a worker, `threads`, which is null, or `host`, this machine's address for workers whose
    /// tickets the caller takes. Links use TLS with a `host`, and where `tls` is true. Workers of a
    /// `crew` stay for its next frame.
    #[pyo3(signature = (settings_json, metadata_json, sharing_json, crew = None))]
    fn render(
        &self,
        py: Python<'_>,
        settings_json: &str,
        metadata_json: &str,
        sharing_json: &str,
        crew: Option<&Crew>,
    ) -> PyResult<RenderJob> {
        let settings: RenderSettings = serde_json::from_str(settings_json).map_err(render_error)?;
        let sharing: Sharing = serde_json::from_str(sharing_json).map_err(render_error)?;
        let kind = sharing.kind.into_workers()?;
        let usual = ClusterOptions::new(sharing.n_workers, kind);
        let options = ClusterOptions {
            journal: sharing.journal,
            crew: crew.map(|crew| crew.0.clone()),
            set: sharing.set,
            specialize_rays: self.specialize_rays,
            tls: usual.tls || sharing.tls,
            ..usual
        };
        let job = py
            .detach(|| ClusterJob::start(&self.scene, &settings, options))
            .map_err(render_error)?;
        RenderJob::new(AnyJob::Workers(job), &self.scene, &settings, metadata_json)
    }
}

/// What tells builds of the engine apart: only equal ones render together.
#[pyfunction]
pub(crate) fn build_hash() -> String {
    format!("{:016x}", kilauea_cluster::build_hash())
}
