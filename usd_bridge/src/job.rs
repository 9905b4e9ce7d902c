use kilauea_film::{ImageMetadata, Packing, write_exr, write_png};
use kilauea_render::{Conditions, PreparedScene, RenderStats};
use kilauea_scene::RenderSettings;
use pyo3::prelude::*;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use crate::error::render_error;

/// A frame being rendered.
#[pyclass(frozen, module = "kilauea._native")]
pub(crate) struct RenderJob {
    job: Mutex<Option<kilauea_render::RenderJob>>,
    prepared: Arc<PreparedScene>,
    metadata: Metadata,
    pixel_aspect_ratio: f32,
    packing: Packing,
}

/// What the caller knows about the frame.
#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Metadata {
    stage: String,
    frame: f64,
    frames_per_second: Option<f64>,
    camera: String,
    #[serde(default)]
    warnings: Vec<String>,
}

impl RenderJob {
    pub(crate) fn start(
        prepared: Arc<PreparedScene>,
        settings: RenderSettings,
        conditions: Conditions,
        metadata_json: &str,
    ) -> PyResult<Self> {
        let metadata = serde_json::from_str(metadata_json).map_err(render_error)?;
        let pixel_aspect_ratio = settings.pixel_aspect_ratio;
        // Under a time limit the file must be written in time as well.
        let packing = match settings.time_limit_secs {
            Some(_) => Packing::Fast,
            None => Packing::Small,
        };
        let job =
            kilauea_render::RenderJob::start_under(conditions, Arc::clone(&prepared), settings)
                .map_err(render_error)?;
        Ok(Self {
            job: Mutex::new(Some(job)),
            prepared,
            metadata,
            pixel_aspect_ratio,
            packing,
        })
    }

    fn with_job<T>(&self, f: impl FnOnce(&kilauea_render::RenderJob) -> T) -> PyResult<T> {
        let job = self.job.lock().unwrap_or_else(PoisonError::into_inner);
        job.as_ref()
            .map(f)
            .ok_or_else(|| render_error("the frame is finished"))
    }
}

#[pymethods]
impl RenderJob {
    /// Wait until rendering has stopped, or for a time; whether it has.
    fn wait(&self, py: Python<'_>, timeout_secs: f64) -> PyResult<bool> {
        let timeout = Duration::try_from_secs_f64(timeout_secs).map_err(render_error)?;
        py.detach(|| self.with_job(|job| job.wait(timeout)))
    }

    /// The fraction done, and the seconds left where they can be told.
    fn progress(&self) -> PyResult<(f64, Option<f64>)> {
        self.with_job(kilauea_render::RenderJob::progress)
    }

    /// Make rendering stop soon.
    fn cancel(&self) -> PyResult<()> {
        self.with_job(kilauea_render::RenderJob::cancel)
    }

    /// Wait for the end, write the picture to each output (`.exr` or `.png`) and return the
    /// statistics as JSON.
    fn finish(&self, py: Python<'_>, outputs: Vec<String>) -> PyResult<String> {
        let job = self
            .job
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        let job = job.ok_or_else(|| render_error("the frame is finished"))?;
        py.detach(|| {
            let mut result = job.finish().map_err(render_error)?;
            let start = Instant::now();
            let mut attributes = BTreeMap::from([
                ("kilauea/stage".to_owned(), self.metadata.stage.clone()),
                ("kilauea/frame".to_owned(), self.metadata.frame.to_string()),
                ("kilauea/camera".to_owned(), self.metadata.camera.clone()),
                ("kilauea/stats".to_owned(), stats_json(&result.stats)?),
            ]);
            let warnings = [&self.metadata.warnings[..], &result.stats.warnings[..]].concat();
            if !warnings.is_empty() {
                attributes.insert("kilauea/warnings".to_owned(), warnings.join("\n"));
            }
            let scene = &self.prepared.scene;
            let metadata = ImageMetadata {
                origin_world: scene.origin_world,
                pixel_aspect_ratio: self.pixel_aspect_ratio,
                camera: Some(scene.camera.clone()),
                frames_per_second: self.metadata.frames_per_second,
                capture_time: Some(SystemTime::now()),
                render_time: Some(Duration::from_secs_f64(result.stats.times.render)),
                packing: self.packing,
                attributes,
                ..ImageMetadata::default()
            };
            for output in &outputs {
                let path = Path::new(output);
                let is_png = path
                    .extension()
                    .is_some_and(|e| e.eq_ignore_ascii_case("png"));
                if is_png {
                    write_png(path, &result.film.to_image(scene.origin_world))
                } else {
                    write_exr(path, &result.film, &metadata)
                }
                .map_err(render_error)?;
            }
            result.stats.times.write = start.elapsed().as_secs_f64();
            stats_json(&result.stats)
        })
    }
}

fn stats_json(stats: &RenderStats) -> PyResult<String> {
    serde_json::to_string(stats).map_err(render_error)
}
