//! A frame being rendered on engine threads of its own.

use kilauea_film::{Aov, Film, FilmSettings, Filter, PixelSample};
use kilauea_math::Vec2;
use kilauea_scene::{DataWindow, RenderSettings};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::RenderError;
use crate::camera::RayGenerator;
use crate::integrator::{PathIntegrator, RayCounts};
use crate::needs::SceneNeeds;
use crate::prepared::PreparedScene;
use crate::sampler::{Purpose, SamplerTables};
use crate::stats::{Memory, RenderStats, SceneSize, Textures, Times, peak_rss_bytes};

/// Edge length of a tile in pixels: small enough that two threads finish a small picture together,
/// large enough that a tile's rays stay close.
const TILE_SIZE: u32 = 32;
/// Most samples that a pixel gets in one pass.
const MAX_PASS_SAMPLES: u32 = 16;

/// A frame in the making.
pub struct RenderJob {
    frame: Arc<Frame>,
    threads: Vec<JoinHandle<()>>,
}

/// A finished frame.
pub struct RenderResult {
    /// Its pixels.
    pub film: Film,
    /// Its statistics.
    pub stats: RenderStats,
}

/// What engine threads share.
struct Frame {
    prepared: Arc<PreparedScene>,
    settings: RenderSettings,
    needs: SceneNeeds,
    film: Film,
    filter: Filter,
    camera: RayGenerator,
    sampler: SamplerTables,
    /// First sample of each pass, and the total at the end.
    pass_starts: Vec<u32>,
    /// By tile: passes done.
    passes_done: Vec<AtomicU32>,
    next_unit: AtomicU64,
    pixels_sampled: AtomicU64,
    n_pixels: u64,
    is_cancelled: AtomicBool,
    start: Instant,
    deadline: Option<Instant>,
    progress: Mutex<Progress>,
    thread_finished: Condvar,
}

#[derive(Default)]
struct Progress {
    n_running: usize,
    counts: RayCounts,
    panic: Option<String>,
    render_secs: f64,
}

impl RenderJob {
    /// Starts rendering at once.
    pub fn start(
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
        });
        let n_pixels = (0..2)
            .map(|i| (i64::from(data_window.max[i]) - i64::from(data_window.min[i])) as u64)
            .product();
        let n_threads = match settings.threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            n => n as usize,
        };
        let frame = Arc::new(Frame {
            needs: if settings.specialize {
                prepared.needs
            } else {
                SceneNeeds::ALL
            },
            filter: Filter::new(settings.filter, settings.filter_radius),
            camera: RayGenerator::new(&scene.camera, settings.resolution, scene.origin_world),
            sampler: SamplerTables::new(
                settings.samples_per_pixel,
                settings.max_depth,
                settings.seed,
            ),
            pass_starts: pass_starts(settings.samples_per_pixel),
            passes_done: (0..film.n_tiles()).map(|_| AtomicU32::new(0)).collect(),
            film,
            next_unit: AtomicU64::new(0),
            pixels_sampled: AtomicU64::new(0),
            n_pixels,
            is_cancelled: AtomicBool::new(false),
            start,
            deadline: settings
                .time_limit_secs
                .map(|secs| start + Duration::from_secs_f64(secs.max(0.0))),
            progress: Mutex::new(Progress {
                n_running: n_threads,
                ..Progress::default()
            }),
            thread_finished: Condvar::new(),
            prepared,
            settings,
        });
        let threads = (0..n_threads)
            .map(|idx| {
                let frame = Arc::clone(&frame);
                std::thread::Builder::new()
                    .name(format!("kilauea-{idx}"))
                    .spawn(move || frame.run_thread())
                    .map_err(|error| RenderError::Panic(format!("cannot start a thread: {error}")))
            })
            .collect::<Result<_, _>>()?;
        Ok(Self { frame, threads })
    }

    /// Waits until all threads have stopped, or for `timeout`; whether they have.
    pub fn wait(&self, timeout: Duration) -> bool {
        let progress = self.frame.lock_progress();
        let (progress, _) = self
            .frame
            .thread_finished
            .wait_timeout_while(progress, timeout, |p| p.n_running > 0)
            .unwrap_or_else(PoisonError::into_inner);
        progress.n_running == 0
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

    /// Makes the threads stop within one tile's pass.
    pub fn cancel(&self) {
        self.frame.is_cancelled.store(true, Ordering::Relaxed);
    }

    /// Waits for the end and returns the picture.
    pub fn finish(self) -> Result<RenderResult, RenderError> {
        for thread in self.threads {
            // A panic inside is caught and reported through `progress`.
            drop(thread.join());
        }
        let frame = Arc::into_inner(self.frame)
            .ok_or_else(|| RenderError::Panic("a thread still holds the frame".into()))?;
        frame.into_result()
    }
}

impl Frame {
    fn lock_progress(&self) -> std::sync::MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn run_thread(self: &Arc<Self>) {
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            if self.needs.cutouts {
                self.run_units::<true>()
            } else {
                self.run_units::<false>()
            }
        }));
        let mut progress = self.lock_progress();
        match outcome {
            Ok(counts) => {
                progress.counts.camera += counts.camera;
                progress.counts.shadow += counts.shadow;
                progress.counts.indirect += counts.indirect;
                progress.counts.invalid += counts.invalid;
            }
            Err(panic) => {
                self.is_cancelled.store(true, Ordering::Relaxed);
                let message = panic
                    .downcast_ref::<String>()
                    .cloned()
                    .or_else(|| panic.downcast_ref::<&str>().map(|&s| s.to_owned()));
                progress.panic = Some(message.unwrap_or_default());
            }
        }
        progress.render_secs = self.start.elapsed().as_secs_f64();
        progress.n_running -= 1;
        drop(progress);
        self.thread_finished.notify_all();
    }

    /// Takes passes over tiles, in order, until none is left or the time is up.
    fn run_units<const CUTOUTS: bool>(&self) -> RayCounts {
        let n_tiles = self.film.n_tiles() as u64;
        let n_passes = self.pass_starts.len() as u64 - 1;
        let mut counts = RayCounts::default();
        loop {
            let is_late = self
                .deadline
                .is_some_and(|deadline| Instant::now() >= deadline);
            if is_late || self.is_cancelled.load(Ordering::Relaxed) {
                break;
            }
            let unit = self.next_unit.fetch_add(1, Ordering::Relaxed);
            if unit >= n_tiles * n_passes {
                break;
            }
            let (pass, tile_idx) = ((unit / n_tiles) as u32, (unit % n_tiles) as usize);
            // With fewer tiles than threads the previous pass may still be under way: sums must
            // be made in order. Its thread never waits for this one.
            while self.passes_done[tile_idx].load(Ordering::Acquire) < pass {
                if self.is_cancelled.load(Ordering::Relaxed) {
                    return counts;
                }
                std::thread::yield_now();
            }
            self.sample_tile::<CUTOUTS>(tile_idx, pass as usize, &mut counts);
            self.passes_done[tile_idx].store(pass + 1, Ordering::Release);
        }
        counts
    }

    fn sample_tile<const CUTOUTS: bool>(
        &self,
        tile_idx: usize,
        pass: usize,
        counts: &mut RayCounts,
    ) {
        let prepared = &*self.prepared;
        let integrator = PathIntegrator {
            geometry: &prepared.geometry,
            lights: &prepared.lights,
            textures: &prepared.textures,
            max_depth: self.settings.max_depth,
            samples_per_pixel: self.settings.samples_per_pixel,
            needs: self.needs,
        };
        let exposure = prepared.scene.camera.exposure_scale;
        let samples = self.pass_starts[pass]..self.pass_starts[pass + 1];
        let mut tile = self.film.tile(tile_idx);
        for (pixel_idx, pixel) in tile.pixels().enumerate() {
            if self.is_cancelled.load(Ordering::Relaxed) {
                return;
            }
            let sequence = self.sampler.pixel(pixel);
            let center = Vec2::new(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5);
            for sample_idx in samples.clone() {
                let sampler = sequence.sampler(sample_idx);
                let offset = self.filter.sample(sampler.pair(Purpose::Filter));
                let lens = if self.needs.lens {
                    sampler.pair(Purpose::Lens)
                } else {
                    Vec2::splat(0.5)
                };
                let time = if self.needs.motion {
                    sampler.pair(Purpose::Time).x
                } else {
                    0.0
                };
                let ray = self.camera.ray(center + offset, lens, time);
                let mut sample = integrator.trace::<CUTOUTS>(&ray, &self.camera, &sampler, counts);
                sample.offset_sq = offset.length_squared();
                if exposure != 1.0 {
                    expose(&mut sample, exposure);
                }
                tile.add(pixel_idx, &sample);
            }
        }
        let n_sampled = tile.n_pixels() as u64 * samples.len() as u64;
        self.pixels_sampled.fetch_add(n_sampled, Ordering::Relaxed);
    }

    fn into_result(self) -> Result<RenderResult, RenderError> {
        let progress = self
            .progress
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        if let Some(message) = progress.panic {
            return Err(RenderError::Panic(message));
        }
        let prepared = &*self.prepared;
        let n_passes = self.pass_starts.len() as u32 - 1;
        let full_passes = self
            .passes_done
            .iter()
            .map(|n| n.load(Ordering::Relaxed))
            .min()
            .unwrap_or(n_passes);
        let (needs, skipped) = self.needs.names();
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
        if progress.counts.invalid > 0 {
            let n = progress.counts.invalid;
            warnings.push(format!("{n} rays could not be traced and hit nothing"));
        }
        let stats = RenderStats {
            samples_per_pixel: samples as f64 / self.n_pixels.max(1) as f64,
            samples,
            invalid_samples: self.film.n_invalid(),
            invalid_rays: progress.counts.invalid,
            times: Times {
                build: prepared.build_secs,
                render: progress.render_secs,
                ..Times::default()
            },
            rays: progress.counts.into(),
            memory: Memory {
                peak_rss: peak_rss_bytes(),
                scene: scene.n_bytes() as u64,
                accel: prepared.geometry.accel().n_bytes() as u64,
                lights: prepared.lights.n_bytes() as u64,
                film: self.film.n_bytes(),
                texture_tiles_peak: tiles.bytes_peak,
                ..Memory::default()
            },
            textures: Textures {
                tiles_total: tiles.tiles_total,
                tiles_loaded: tiles.tiles_loaded,
                bytes_read: tiles.bytes_read,
            },
            scene: SceneSize {
                placements: prepared.geometry.n_placements() as u64,
                lights: prepared.lights.len() as u64,
                ..SceneSize::of(scene)
            },
            needs,
            skipped,
            is_complete: full_passes == n_passes,
            full_passes,
            warnings,
        };
        Ok(RenderResult {
            film: self.film,
            stats,
        })
    }
}

/// Scales all light of a sample.
fn expose(sample: &mut PixelSample, exposure: f32) {
    for light in [
        &mut sample.beauty,
        &mut sample.emission,
        &mut sample.direct_diffuse,
        &mut sample.direct_specular,
        &mut sample.indirect_diffuse,
        &mut sample.indirect_specular,
    ] {
        *light *= exposure;
    }
}

/// 1, 1, 2, 4, … samples, so that a first picture and an estimate of the time left come early.
fn pass_starts(samples_per_pixel: u32) -> Vec<u32> {
    let mut starts = vec![0];
    let mut done = 0;
    while done < samples_per_pixel {
        done += done
            .clamp(1, MAX_PASS_SAMPLES)
            .min(samples_per_pixel - done);
        starts.push(done);
    }
    starts
}

fn check_settings(settings: &RenderSettings) -> Result<(), RenderError> {
    let fail = |name, value: String, reason| {
        Err(RenderError::Setting {
            name,
            value,
            reason,
        })
    };
    let [width, height] = settings.resolution;
    if width == 0 || height == 0 || width > 65536 || height > 65536 {
        let value = format!("{width} x {height}");
        return fail("resolution", value, "each side must be 1 to 65536 pixels");
    }
    if settings.samples_per_pixel == 0 {
        return fail("samples_per_pixel", "0".into(), "must be at least 1");
    }
    if let Some(w) = settings.data_window
        && (w.min[0] >= w.max[0] || w.min[1] >= w.max[1])
    {
        return fail(
            "data_window",
            format!("{w:?}"),
            "must hold at least one pixel",
        );
    }
    if let Some(radius) = settings.filter_radius
        && !(radius > 0.0 && radius.is_finite())
    {
        return fail("filter_radius", radius.to_string(), "must be positive");
    }
    if let Some(secs) = settings.time_limit_secs
        && !secs.is_finite()
    {
        return fail("time_limit_secs", secs.to_string(), "must be a number");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_double_and_add_up() {
        assert_eq!(pass_starts(1), [0, 1]);
        assert_eq!(pass_starts(5), [0, 1, 2, 4, 5]);
        assert_eq!(pass_starts(64), [0, 1, 2, 4, 8, 16, 32, 48, 64]);
    }

    #[test]
    fn impossible_settings_are_refused() {
        let with = |change: fn(&mut RenderSettings)| {
            let mut settings = RenderSettings::default();
            change(&mut settings);
            check_settings(&settings)
        };
        assert!(with(|_| ()).is_ok());
        assert!(with(|s| s.resolution = [0, 4]).is_err());
        assert!(with(|s| s.samples_per_pixel = 0).is_err());
        assert!(
            with(|s| s.data_window = Some(DataWindow {
                min: [3, 0],
                max: [3, 4]
            }))
            .is_err()
        );
        assert!(with(|s| s.filter_radius = Some(f32::NAN)).is_err());
    }
}
