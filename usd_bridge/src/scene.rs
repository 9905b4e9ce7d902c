use kilauea_cluster::{EstimatesOf, load_estimates, save_estimates};
use kilauea_render::{PrepareOptions, PreparedScene, SetPlan};
use kilauea_scene::RenderSettings;
use pyo3::prelude::*;
use serde_json::json;
use std::path::PathBuf;
use std::sync::Arc;

use crate::error::render_error;
use crate::job::{AnyJob, RenderJob};

/// A scene that is ready to be rendered any number of times.
#[pyclass(frozen, module = "kilauea._native")]
pub(crate) struct Scene {
    pub(crate) prepared: Arc<PreparedScene>,
    pub(crate) warnings: Vec<String>,
    pub(crate) assemble_secs: f64,
}

#[pymethods]
impl Scene {
    /// What was found wrong and left out.
    fn warnings(&self) -> Vec<String> {
        let prepared = &self.prepared.warnings;
        self.warnings.iter().chain(prepared).cloned().collect()
    }

    /// Seconds spent, as a JSON object.
    fn stats(&self) -> String {
        json!({
            "assemble_secs": self.assemble_secs,
            "build_secs": self.prepared.build_secs,
        })
        .to_string()
    }

    /// Start rendering on threads of the engine's own; `conditions_json` is for experiments, an
    /// object with any field of `kilauea_render::Conditions`. What the pilot of the same frame told is
    /// taken from the file `estimates`, if one is given.
    #[pyo3(signature = (settings_json, metadata_json, conditions_json = "{}", estimates = None))]
    fn render(
        &self,
        py: Python<'_>,
        settings_json: &str,
        metadata_json: &str,
        conditions_json: &str,
        estimates: Option<PathBuf>,
    ) -> PyResult<RenderJob> {
        let settings: RenderSettings = serde_json::from_str(settings_json).map_err(render_error)?;
        let conditions = serde_json::from_str(conditions_json).map_err(render_error)?;
        let scene = &self.prepared.scene;
        let told = py.detach(|| {
            let told =
                estimates.map(|path| load_estimates(&path, &EstimatesOf::frame(scene, &settings)));
            told.transpose().map_err(render_error)
        })?;
        let (prepared, its) = (Arc::clone(&self.prepared), settings.clone());
        let job = match told {
            None => kilauea_render::RenderJob::start_under(conditions, prepared, its),
            Some(told) => kilauea_render::RenderJob::start_told(conditions, prepared, its, told),
        };
        let job = AnyJob::Threads(job.map_err(render_error)?);
        RenderJob::new(job, scene, &settings, metadata_json)
    }

    /// Write what the pilot of a frame of this scene told to a file, once rendering has stopped.
    fn save_estimates(
        &self,
        py: Python<'_>,
        job: &Bound<'_, RenderJob>,
        settings_json: &str,
        path: PathBuf,
    ) -> PyResult<()> {
        let settings: RenderSettings = serde_json::from_str(settings_json).map_err(render_error)?;
        let learnt = job.get().with_job(|job| match job {
            AnyJob::Threads(job) => Some(job.learnt()),
            AnyJob::Workers(_) => None,
        })?;
        let learnt = learnt.ok_or_else(|| render_error("workers keep what they learn"))?;
        py.detach(|| {
            let of = EstimatesOf::frame(&self.prepared.scene, &settings);
            save_estimates(&path, of, &learnt).map_err(render_error)
        })
    }

    /// The same scene with its surfaces spread evenly over so many members of a set in this process.
    fn spread(&self, py: Python<'_>, n_members: usize) -> PyResult<Self> {
        py.detach(|| {
            let whole = &self.prepared.scene;
            let plan = SetPlan::even(whole, n_members).map_err(render_error)?;
            let prepared = PreparedScene::spread(whole, &plan, &PrepareOptions::default());
            Ok(Self {
                prepared: Arc::new(prepared.map_err(render_error)?),
                warnings: self.warnings.clone(),
                assemble_secs: self.assemble_secs,
            })
        })
    }

    /// Write the scene into a folder as `scene.json` and raw arrays, for other renderers.
    fn export(&self, py: Python<'_>, folder: PathBuf, settings_json: &str) -> PyResult<()> {
        let settings: RenderSettings = serde_json::from_str(settings_json).map_err(render_error)?;
        py.detach(|| self.prepared.scene.export(&folder, &settings))
            .map_err(|error| render_error(format!("{}: {error}", folder.display())))
    }
}
