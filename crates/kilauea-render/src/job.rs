//! A frame being rendered on engine threads of its own.

use kilauea_film::{Aov, Film, FilmSettings, Filter};
use kilauea_scene::{DataWindow, RenderSettings};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::RenderError;
use crate::camera::RayGenerator;
use crate::check::check_settings;
use crate::conditions::Conditions;
use crate::frame::Frame;
use crate::gather::GatherEstimate;
use crate::integrator::Blame;
use crate::needs::SceneNeeds;
use crate::noise::NoiseGate;
use crate::passes::{Passes, TILE_SIZE};
use crate::prepared::PreparedScene;
use crate::sampler::SamplerTables;
use crate::set::Traffic;
use crate::stats::RenderStats;
use crate::units::UnitSource;

/// A frame in the making.
pub struct RenderJob {
    frame: Arc<Frame>,
    thread: JoinHandle<()>,
}

/// A finished frame.
pub struct RenderResult {
    /// Its pixels.
    pub film: Film,
    /// Its statistics.
    pub stats: RenderStats,
}

impl RenderJob {
    /// Starts rendering at once.
    pub fn start(
        prepared: Arc<PreparedScene>,
        settings: RenderSettings,
    ) -> Result<Self, RenderError> {
        Self::start_under(Conditions::default(), prepared, settings)
    }

    /// Starts rendering under the conditions of an experiment. The image is the same.
    pub fn start_under(
        conditions: Conditions,
        prepared: Arc<PreparedScene>,
        settings: RenderSettings,
    ) -> Result<Self, RenderError> {
        Self::start_frame(Frame::new(conditions, prepared, settings)?)
    }

    /// Starts rendering units of a frame as `source` hands them out, until it has no more. What is
    /// left of the frame is in its results; the statistics have what no unit was charged with.
    pub fn start_units(
        conditions: Conditions,
        prepared: Arc<PreparedScene>,
        settings: RenderSettings,
        source: Arc<dyn UnitSource>,
    ) -> Result<Self, RenderError> {
        let mut frame = Frame::new(conditions, prepared, settings)?;
        frame.units = Some(source);
        Self::start_frame(frame)
    }

    /// Starts rendering with what the pilot of the same frame told before, in place of a pilot. The
    /// image is the same.
    pub fn start_told(
        conditions: Conditions,
        prepared: Arc<PreparedScene>,
        settings: RenderSettings,
        told: GatherEstimate,
    ) -> Result<Self, RenderError> {
        let mut frame = Frame::new(conditions, prepared, settings)?;
        frame.told = Some(Arc::new(told));
        Self::start_frame(frame)
    }

    /// What paths are told, once rendering has stopped: nothing, but by the integrator `kilauea`.
    pub fn learnt(&self) -> Arc<GatherEstimate> {
        Arc::clone(&self.frame.lock_outcome().learnt)
    }

    fn start_frame(frame: Frame) -> Result<Self, RenderError> {
        let frame = Arc::new(frame);
        let thread = std::thread::Builder::new()
            .name("render".to_owned())
            .spawn({
                let frame = Arc::clone(&frame);
                move || frame.render()
            })
            .map_err(|error| RenderError::Panic(format!("cannot start a thread: {error}")))?;
        Ok(Self { frame, thread })
    }

    /// Waits until rendering has stopped, or for `timeout`; whether it has.
    pub fn wait(&self, timeout: Duration) -> bool {
        let outcome = self.frame.lock_outcome();
        let (outcome, _) = self
            .frame
            .ended
            .wait_timeout_while(outcome, timeout, |o| !o.has_ended)
            .unwrap_or_else(PoisonError::into_inner);
        outcome.has_ended
    }

    /// Fraction of the samples taken, and the seconds left at this speed.
    pub fn progress(&self) -> (f64, Option<f64>) {
        let frame = &self.frame;
        let total = frame.n_pixels * u64::from(frame.settings.samples_per_pixel);
        let done = frame.pixels_sampled.load(Ordering::Relaxed);
        let by_samples = done as f64 / total.max(1) as f64;
        let elapsed = frame.start.elapsed().as_secs_f64();
        let left = (by_samples > 0.0).then(|| elapsed * (1.0 - by_samples) / by_samples);
        let Some(limit) = frame.settings.time_limit_secs else {
            return (by_samples, left);
        };
        let left_to_limit = (limit - elapsed).max(0.0);
        let left = left.map_or(left_to_limit, |left| left.min(left_to_limit));
        (
            by_samples.max(elapsed / limit.max(1e-9)).min(1.0),
            Some(left),
        )
    }

    /// Makes the threads stop within the samples of a pixel.
    pub fn cancel(&self) {
        self.frame.is_cancelled.store(true, Ordering::Relaxed);
    }

    /// Waits for the end and returns the picture.
    pub fn finish(self) -> Result<RenderResult, RenderError> {
        // Panics of engine threads are caught and in the outcome.
        if self.thread.join().is_err() {
            return Err(RenderError::Panic("the thread of the frame died".into()));
        }
        let frame = Arc::into_inner(self.frame)
            .ok_or_else(|| RenderError::Panic("a thread still holds the frame".into()))?;
        frame.into_result()
    }
}

/// The film of a frame with those settings, once those are checked.
pub(crate) fn empty_film(settings: &RenderSettings) -> Result<Film, RenderError> {
    check_settings(settings)?;
    let data_window = settings.data_window.unwrap_or(DataWindow {
        min: [0, 0],
        max: settings.resolution.map(|n| n as i32),
    });
    let aovs = if settings.aovs.is_empty() {
        Aov::all().collect()
    } else {
        let names = settings.aovs.iter();
        names.map(|name| name.parse()).collect::<Result<_, _>>()?
    };
    Ok(Film::new(FilmSettings {
        resolution: settings.resolution,
        data_window,
        tile_size: TILE_SIZE,
        aovs,
        tracks_variance: settings.noise.is_some(),
    }))
}

/// Whether a layer holds what the first hit is like.
fn describes_surface(aov: Aov) -> bool {
    match aov {
        Aov::N | Aov::P | Aov::Albedo | Aov::PrimId | Aov::InstanceId => true,
        Aov::Beauty
        | Aov::Z
        | Aov::DirectDiffuse
        | Aov::IndirectDiffuse
        | Aov::DirectSpecular
        | Aov::IndirectSpecular
        | Aov::Emission
        | Aov::SampleCount
        | Aov::Variance => false,
    }
}

impl Frame {
    /// A frame that nothing has been rendered of.
    pub(crate) fn new(
        conditions: Conditions,
        prepared: Arc<PreparedScene>,
        settings: RenderSettings,
    ) -> Result<Self, RenderError> {
        let start = Instant::now();
        let film = empty_film(&settings)?;
        let n_threads = match settings.threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            n => n as usize,
        };
        let needs = if settings.specialize {
            SceneNeeds {
                surface_layers: film.aovs().iter().copied().any(describes_surface),
                ..prepared.needs
            }
        } else {
            SceneNeeds::ALL
        };
        let needs = needs
            .with(&settings.general)
            .map_err(|name| RenderError::Setting {
                name: "general",
                value: name.to_owned(),
                reason: "no feature has that name",
            })?;
        Ok(Self {
            needs,
            filter: Filter::new(settings.filter, settings.filter_radius),
            camera: RayGenerator::new(
                &prepared.camera,
                settings.resolution,
                prepared.scene.origin_world,
            ),
            sampler: SamplerTables::new(
                settings.samples_per_pixel,
                settings.max_depth,
                settings.seed,
            ),
            passes: Passes::new(&film, settings.samples_per_pixel),
            n_pixels: film.n_pixels(),
            noise: settings.noise.map(|noise| NoiseGate::new(&film, noise)),
            film,
            units: None,
            told: None,
            pixels_sampled: AtomicU64::new(0),
            is_cancelled: AtomicBool::new(false),
            has_panicked: AtomicBool::new(false),
            start,
            deadline: settings
                .time_limit_secs
                .map(|secs| start + Duration::from_secs_f64(secs.max(0.0))),
            n_threads,
            blame: Blame::default(),
            traffic: Traffic::new(prepared.member_bytes().len(), conditions.sample_one_in),
            photons: (prepared.set.as_ref())
                .filter(|set| set.has_own())
                .map(|set| Arc::clone(&set.photons))
                .unwrap_or_default(),
            lost_photons: AtomicU32::new(0),
            outcome: Mutex::default(),
            ended: Condvar::new(),
            prepared,
            settings,
            conditions,
        })
    }
}
