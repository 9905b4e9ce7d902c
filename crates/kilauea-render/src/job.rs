//! A frame being rendered on engine threads of its own.

use kilauea_film::{Aov, Film, FilmSettings, Filter};
use kilauea_scene::{DataWindow, RenderSettings};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::RenderError;
use crate::camera::RayGenerator;
use crate::check::check_settings;
use crate::conditions::Conditions;
use crate::frame::Frame;
use crate::integrator::Blame;
use crate::needs::SceneNeeds;
use crate::noise::NoiseGate;
use crate::passes::{Passes, TILE_SIZE};
use crate::prepared::PreparedScene;
use crate::sampler::SamplerTables;
use crate::stats::{Memory, Rays, RenderStats, SceneSize, Textures, Times, peak_rss_bytes};

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
        let frame = Arc::new(Frame::new(conditions, prepared, settings)?);
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
        check_settings(&settings)?;
        let scene = &prepared.scene;
        let data_window = settings.data_window.unwrap_or(DataWindow {
            min: [0, 0],
            max: settings.resolution.map(|n| n as i32),
        });
        let aovs = if settings.aovs.is_empty() {
            Aov::all().collect()
        } else {
            settings
                .aovs
                .iter()
                .map(|name| name.parse())
                .collect::<Result<_, _>>()?
        };
        let film = Film::new(FilmSettings {
            resolution: settings.resolution,
            data_window,
            tile_size: TILE_SIZE,
            aovs,
            tracks_variance: settings.noise.is_some(),
        });
        let n_pixels = (0..2)
            .map(|i| (i64::from(data_window.max[i]) - i64::from(data_window.min[i])) as u64)
            .product();
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
            camera: RayGenerator::new(&scene.camera, settings.resolution, scene.origin_world),
            sampler: SamplerTables::new(
                settings.samples_per_pixel,
                settings.max_depth,
                settings.seed,
            ),
            passes: Passes::new(&film, settings.samples_per_pixel),
            noise: settings.noise.map(|noise| NoiseGate::new(&film, noise)),
            film,
            pixels_sampled: AtomicU64::new(0),
            n_pixels,
            is_cancelled: AtomicBool::new(false),
            has_panicked: AtomicBool::new(false),
            start,
            deadline: settings
                .time_limit_secs
                .map(|secs| start + Duration::from_secs_f64(secs.max(0.0))),
            n_threads,
            blame: Blame::default(),
            outcome: Mutex::default(),
            ended: Condvar::new(),
            prepared,
            settings,
            conditions,
        })
    }

    /// What was rendered, once rendering has stopped.
    fn into_result(self) -> Result<RenderResult, RenderError> {
        let (pixels_stopped, is_clean) = (self.n_pixels_stopped(), self.is_clean());
        let outcome = self
            .outcome
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        if let Some(error) = outcome.error {
            return Err(error);
        }
        let prepared = &*self.prepared;
        let full_passes = self.passes.n_done();
        let (needs, skipped) = SceneNeeds {
            guided_directions: self.needs.guided_directions || outcome.is_guided,
            ..self.needs
        }
        .names();
        let scene = &prepared.scene;
        let tiles = prepared.textures.stats();
        let samples = self.film.n_samples();
        let mut warnings = prepared.warnings.clone();
        warnings.extend(
            prepared
                .textures
                .take_errors()
                .iter()
                .map(ToString::to_string),
        );
        if outcome.counts.invalid > 0 {
            let n = outcome.counts.invalid;
            warnings.push(format!("{n} rays could not be traced and hit nothing"));
        }
        if outcome.counts.in_too_many_media > 0 {
            let n = outcome.counts.in_too_many_media;
            warnings.push(format!(
                "{n} paths were in too many media at once; those of the lowest priority were \
                 forgotten"
            ));
        }
        let geometry = &prepared.geometry;
        warnings.extend(outcome.faults.lines(|at| {
            let prim = scene.prim_path(geometry.ids(at).0.cast_unsigned());
            format!(", on {prim} of material {}", geometry.material_path(at))
        }));
        let stats = RenderStats {
            samples_per_pixel: samples as f64 / self.n_pixels.max(1) as f64,
            samples,
            pixels_stopped,
            invalid_samples: self.film.n_invalid(),
            invalid_samples_by_step: outcome.faults.counts(),
            invalid_rays: outcome.counts.invalid,
            times: Times {
                build: prepared.build_secs,
                photon: outcome.caustics.seconds,
                gather: outcome.gather_secs,
                render: outcome.render_secs,
                ..Times::default()
            },
            rays: Rays {
                photon: outcome.caustics.rays,
                ..outcome.counts.into()
            },
            memory: Memory {
                peak_rss: peak_rss_bytes(),
                scene: scene.n_bytes() as u64,
                accel: prepared.geometry.accel().n_bytes() as u64,
                lights: prepared.lights.n_bytes() as u64,
                film: self.film.n_bytes(),
                photons: outcome.caustics.bytes_peak,
                shades_in_flight_peak: outcome.shades.peak_bytes(),
                texture_tiles_peak: tiles.bytes_peak,
            },
            shades: outcome.shades.stats(),
            photons: outcome.caustics,
            gather: outcome.gather,
            textures: Textures {
                tiles_total: tiles.tiles_total,
                tiles_loaded: tiles.tiles_loaded,
                bytes_read: tiles.bytes_read,
                values_replaced: tiles.values_replaced,
            },
            scene: SceneSize {
                placements: prepared.geometry.n_placements() as u64,
                lights: prepared.lights.len() as u64,
                ..SceneSize::of(scene)
            },
            needs,
            skipped,
            is_complete: full_passes == self.passes.n_passes() || is_clean,
            full_passes,
            warnings,
        };
        Ok(RenderResult {
            film: self.film,
            stats,
        })
    }
}
