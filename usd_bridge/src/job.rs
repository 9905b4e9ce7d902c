use kilauea_cluster::{ClusterJob, Journal, NetworkStats, WorkerStats};
use kilauea_film::{Film, ImageMetadata, Packing, write_exr, write_png};
use kilauea_math::DVec3;
use kilauea_render::{RenderResult, RenderStats};
use kilauea_scene::{Camera, RenderSettings, Scene};
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use crate::error::render_error;

/// A frame being rendered.
#[pyclass(frozen, module = "kilauea._native")]
pub(crate) struct RenderJob {
    job: Mutex<Option<AnyJob>>,
    origin_world: DVec3,
    camera: Camera,
    metadata: Metadata,
    pixel_aspect_ratio: f32,
    packing: Packing,
}

/// By whom it is rendered.
pub(crate) enum AnyJob {
    /// By threads of this process.
    Threads(kilauea_render::RenderJob),
    /// By other processes.
    Workers(ClusterJob),
}

/// What is left of a job.
struct Finished {
    film: Film,
    statistics: Statistics,
    /// What nobody needs once the image is written.
    journal: Option<Journal>,
}

/// Statistics as they are written.
#[derive(Serialize)]
struct Statistics {
    #[serde(flatten)]
    stats: RenderStats,
    #[serde(flatten)]
    cluster: Option<ClusterStatistics>,
}

/// What there is where other processes render.
#[derive(Serialize)]
struct ClusterStatistics {
    workers: Vec<WorkerStats>,
    network: NetworkStats,
}

impl AnyJob {
    fn wait(&self, timeout: Duration) -> bool {
        match self {
            Self::Threads(job) => job.wait(timeout),
            Self::Workers(job) => job.wait(timeout),
        }
    }

    fn progress(&self) -> (f64, Option<f64>) {
        match self {
            Self::Threads(job) => job.progress(),
            Self::Workers(job) => job.progress(),
        }
    }

    fn cancel(&self) {
        match self {
            Self::Threads(job) => job.cancel(),
            Self::Workers(job) => job.cancel(),
        }
    }

    fn finish(self) -> PyResult<Finished> {
        match self {
            Self::Threads(job) => {
                let RenderResult { film, stats } = job.finish().map_err(render_error)?;
                Ok(Finished {
                    film,
                    statistics: Statistics {
                        stats,
                        cluster: None,
                    },
                    journal: None,
                })
            }
            Self::Workers(job) => {
                let result = job.finish().map_err(render_error)?;
                let RenderResult { film, stats } = result.frame;
                let cluster = Some(ClusterStatistics {
                    workers: result.workers,
                    network: result.network,
                });
                Ok(Finished {
                    film,
                    statistics: Statistics { stats, cluster },
                    journal: result.journal,
                })
            }
        }
    }
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
    /// A job that was started.
    pub(crate) fn new(
        job: AnyJob,
        scene: &Scene,
        settings: &RenderSettings,
        metadata_json: &str,
    ) -> PyResult<Self> {
        // Under a time limit the file must be written in time as well.
        let packing = match settings.time_limit_secs {
            Some(_) => Packing::Fast,
            None => Packing::Small,
        };
        Ok(Self {
            job: Mutex::new(Some(job)),
            origin_world: scene.origin_world,
            camera: scene.camera.clone(),
            metadata: serde_json::from_str(metadata_json).map_err(render_error)?,
            pixel_aspect_ratio: settings.pixel_aspect_ratio,
            packing,
        })
    }

    pub(crate) fn with_job<T>(&self, f: impl FnOnce(&AnyJob) -> T) -> PyResult<T> {
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
        self.with_job(AnyJob::progress)
    }

    /// The tickets of workers that the caller is to start, each once, as lines of JSON.
    fn take_tickets(&self) -> PyResult<Vec<String>> {
        let tickets = self.with_job(|job| match job {
            AnyJob::Threads(_) => Vec::new(),
            AnyJob::Workers(job) => job.take_tickets(),
        })?;
        let lines = tickets.iter().map(serde_json::to_string);
        lines.collect::<Result<_, _>>().map_err(render_error)
    }

    /// Say that a worker has ended whom the caller started, by the epoch on its ticket.
    fn worker_ended(&self, epoch: u32, reason: String) -> PyResult<()> {
        self.with_job(|job| match job {
            AnyJob::Threads(_) => {}
            AnyJob::Workers(job) => job.worker_ended(epoch, reason),
        })
    }

    /// The numbers of workers that hold the frame up: that have said nothing for a while, or are at
    /// less than half the mean speed.
    fn laggards(&self) -> PyResult<Vec<u32>> {
        self.with_job(|job| match job {
            AnyJob::Threads(_) => Vec::new(),
            AnyJob::Workers(job) => job.snapshot().laggards(),
        })
    }

    /// Make rendering stop soon.
    fn cancel(&self) -> PyResult<()> {
        self.with_job(AnyJob::cancel)
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
            let Finished {
                film,
                mut statistics,
                journal,
            } = job.finish()?;
            let start = Instant::now();
            let mut attributes = BTreeMap::from([
                ("kilauea/stage".to_owned(), self.metadata.stage.clone()),
                ("kilauea/frame".to_owned(), self.metadata.frame.to_string()),
                ("kilauea/camera".to_owned(), self.metadata.camera.clone()),
                ("kilauea/stats".to_owned(), stats_json(&statistics)?),
            ]);
            let warnings = [&self.metadata.warnings[..], &statistics.stats.warnings[..]].concat();
            if !warnings.is_empty() {
                attributes.insert("kilauea/warnings".to_owned(), warnings.join("\n"));
            }
            let metadata = ImageMetadata {
                origin_world: self.origin_world,
                pixel_aspect_ratio: self.pixel_aspect_ratio,
                camera: Some(self.camera.clone()),
                frames_per_second: self.metadata.frames_per_second,
                capture_time: Some(SystemTime::now()),
                render_time: Some(Duration::from_secs_f64(statistics.stats.times.render)),
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
                    write_png(path, &film.to_image(self.origin_world))
                } else {
                    write_exr(path, &film, &metadata)
                }
                .map_err(render_error)?;
            }
            if let Some(journal) = journal {
                journal.remove().map_err(render_error)?;
            }
            statistics.stats.times.write = start.elapsed().as_secs_f64();
            stats_json(&statistics)
        })
    }
}

fn stats_json(statistics: &Statistics) -> PyResult<String> {
    serde_json::to_string(statistics).map_err(render_error)
}
