//! What a render reports: times, rays, memory, and what was skipped.

use std::borrow::Cow;
use std::collections::BTreeMap;

use kilauea_scene::Scene;
use serde::{Deserialize, Serialize};

use crate::integrator::RayCounts;
use crate::set::SetStats;

/// Statistics of one frame, in the form of the stats file.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct RenderStats {
    /// Mean over the rendered pixels.
    pub samples_per_pixel: f64,
    /// Samples in all pixels.
    pub samples: u64,
    /// Pixels that got fewer samples than others, as they were clean enough.
    pub pixels_stopped: u64,
    /// Samples that were NaN or infinite and taken as black.
    pub invalid_samples: u64,
    /// These samples by the step of their path that was the first to be not finite.
    pub invalid_samples_by_step: BTreeMap<Cow<'static, str>, u64>,
    /// Rays that could not be traced: with a NaN, without a direction, or of an empty range.
    pub invalid_rays: u64,
    /// Seconds.
    pub times: Times,
    /// Rays traced.
    pub rays: Rays,
    /// Bytes.
    pub memory: Memory,
    /// Shades that waited for answers.
    pub shades: ShadeStats,
    /// Photons that caustics are found by.
    pub photons: CausticStats,
    /// What final-gather estimation found.
    pub gather: GatherStats,
    /// What paths were aimed at.
    pub aim: AimStats,
    /// Irradiance that paths look up.
    pub final_gather: FinalGatherStats,
    /// Texture tiles.
    pub textures: Textures,
    /// Size of the scene.
    pub scene: SceneSize,
    /// What was asked of the members of a set, where the scene is spread over one.
    pub set: Option<SetStats>,
    /// Passes over paths that several workers followed together, each path once.
    pub shared_passes: Vec<Cow<'static, str>>,
    /// Features in use.
    pub needs: Vec<Cow<'static, str>>,
    /// Features not in use, whose work was skipped.
    pub skipped: Vec<Cow<'static, str>>,
    /// Whether every pixel got all of its samples, or was clean enough before.
    pub is_complete: bool,
    /// Passes over the whole image that were finished.
    pub full_passes: u32,
    /// What was found wrong and left out.
    pub warnings: Vec<String>,
}

/// Seconds spent by phase; wall time.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Times {
    /// Trees and lights.
    pub build: f64,
    /// Tracing photons.
    pub photon: f64,
    /// Estimating gathers.
    pub gather: f64,
    /// Tracing paths.
    pub render: f64,
    /// Writing files.
    pub write: f64,
}

/// Rays by purpose.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Rays {
    /// From the camera.
    pub camera: u64,
    /// Toward lights.
    pub shadow: u64,
    /// Scattered.
    pub indirect: u64,
    /// Of photons.
    pub photon: u64,
}

impl From<RayCounts> for Rays {
    fn from(counts: RayCounts) -> Self {
        Self {
            camera: counts.camera,
            shadow: counts.shadow,
            indirect: counts.indirect,
            photon: 0,
        }
    }
}

/// Shades that waited for answers, zeros where none did.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct ShadeStats {
    /// Most shades in flight, in the pass that took most memory.
    pub in_flight_peak: u64,
    /// Questions whose answers they had not read when they took most memory.
    pub questions_at_peak: u64,
    /// Questions asked in all.
    pub questions: u64,
    /// Fraction of the time in which engine threads had something to do, until the last pixel of
    /// each pass had begun.
    pub busy: f64,
}

/// Bytes held.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Memory {
    /// Highest resident size of the process.
    pub peak_rss: u64,
    /// Mesh chunks.
    pub scene: u64,
    /// Tree over triangles.
    pub accel: u64,
    /// Tree over lights.
    pub lights: u64,
    /// Pixels.
    pub film: u64,
    /// The largest photon map.
    pub photons: u64,
    /// Shades waiting for answers, at their highest: the sum of each thread's own peak.
    pub shades_in_flight_peak: u64,
    /// Texture tiles, at their highest.
    pub texture_tiles_peak: u64,
}

/// What final-gather estimation found; zeros where there was none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GatherStats {
    /// Training paths traced.
    pub paths: u64,
    /// What they left.
    pub records: u64,
    /// Cells of directions.
    pub cells: u64,
    /// Bytes that all cells take.
    pub bytes: u64,
    /// What directions from cells promise by the records of plain paths: the second moment of what
    /// vertices bring without them, over that with them; zero where that tells nothing.
    pub forecast: f32,
    /// Lights that training paths chose.
    pub choices: u64,
    /// Share of them that brought nothing.
    pub choices_in_vain: f32,
    /// Cells of lights.
    pub light_cells: u64,
    /// Variance of plain paths over that of paths that choose lights by cells, by the records of the
    /// former: the most that pictures gain. Zero where they tell nothing.
    pub forecast_of_lights: f32,
    /// Pixels that got all of their samples with lights chosen by cells and without, as a trial.
    pub pixels_tried: u64,
    /// Efficiency of pixels whose lights are chosen by cells, over that of plain ones, as trial and
    /// forecast together say; zero where it was not tried.
    pub gain_of_lights: f32,
    /// Efficiency, one over variance and cost, of paths whose directions come from cells, over that
    /// of plain paths; zero where it was not measured.
    pub efficiency_of_directions: f32,
}

/// What paths were aimed at; zeros where there was nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct AimStats {
    /// Paths that lights sent out.
    pub emitted: u64,
    /// How often their light arrived over specular surfaces alone, and was bright.
    pub arrivals: u64,
    /// Cells of directions.
    pub cells: u64,
    /// Bytes that all cells take.
    pub bytes: u64,
}

/// Irradiance that paths look up at their second rough vertex; zeros where there was none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FinalGatherStats {
    /// Paths that lights sent out, those of the pilot among them.
    pub emitted: u64,
    /// Of the light of photons that were sent everywhere, the share that arrives where irradiance
    /// is looked up. Where it is little, light is aimed there.
    pub seen: f64,
    /// Photons kept of those that were looked up last.
    pub photons: u64,
    /// Places of which irradiance is known.
    pub records: u64,
    /// Bytes that they take.
    pub bytes: u64,
    /// Efficiency of pixels whose paths look irradiance up, bias counted as error, over that of others,
    /// as the pilot forecasts it; zero where it was not tried.
    pub gain: f64,
    /// Squared bias of pixels, relative to the picture, by the fewer photons of the pilot. By chance it
    /// may be less than zero.
    pub squared_bias: f64,
    /// Why nothing was looked up, where it was asked for.
    pub skipped: Vec<String>,
}

/// What photons did for the caustics of a frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CausticStats {
    /// Paths that lights sent out.
    pub emitted: u64,
    /// Photons kept of them, in all passes.
    pub stored: u64,
    /// How far photons were merged with in the first pass, in scene units.
    pub first_radius: f32,
    /// The same in the last one.
    pub last_radius: f32,
    /// Why there are none, where they were asked for.
    pub skipped: Vec<String>,
    /// Seconds of wall time for tracing them and building their maps.
    #[serde(skip)]
    pub(crate) seconds: f64,
    /// Rays traced for them.
    #[serde(skip)]
    pub(crate) rays: u64,
    /// Of the largest map.
    #[serde(skip)]
    pub(crate) bytes_peak: u64,
}

/// Texture tiles read.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Textures {
    /// Tiles that exist.
    pub tiles_total: u64,
    /// Reads of a tile, repeated ones included.
    pub tiles_loaded: u64,
    /// Tiles that were brought before a lookup needed them.
    pub tiles_fetched: u64,
    /// Seconds for which lookups waited for tiles, all threads together.
    pub seconds_waited: f64,
    /// Bytes read.
    pub bytes_read: u64,
    /// Values of all images that were NaN or infinite, and that something stands for.
    pub values_replaced: u64,
}

/// Size of the scene.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct SceneSize {
    /// Triangles, each prototype once.
    pub unique_triangles: u64,
    /// Curve segments, each prototype once.
    pub unique_segments: u64,
    /// Points, each prototype once.
    pub unique_points: u64,
    /// Chunks of any kind.
    pub chunks: u64,
    /// Prototypes.
    pub prototypes: u64,
    /// Placed prototypes.
    pub placements: u64,
    /// Lights and emissive triangles.
    pub lights: u64,
    /// Materials.
    pub materials: u64,
}

impl SceneSize {
    /// What the scene alone tells: not its placements and lights.
    pub(crate) fn of(scene: &Scene) -> Self {
        let mut size = Self {
            prototypes: scene.prototypes.len() as u64,
            materials: scene.materials.len() as u64,
            ..Self::default()
        };
        for prototype in &scene.prototypes {
            let n_triangles: usize = prototype.chunks.iter().map(|c| c.triangles.len()).sum();
            let n_segments: usize = prototype.curves.iter().map(|c| c.segments.len()).sum();
            let n_points: usize = prototype.points.iter().map(|c| c.centers.len()).sum();
            let n_chunks = prototype.chunks.len() + prototype.curves.len() + prototype.points.len();
            size.unique_triangles += n_triangles as u64;
            size.unique_segments += n_segments as u64;
            size.unique_points += n_points as u64;
            size.chunks += n_chunks as u64;
        }
        size
    }
}

/// Highest resident size of this process in bytes; 0 where the system does not tell.
pub fn peak_rss_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))
        .and_then(|rest| rest.trim().strip_suffix("kB"))
        .and_then(|kb| kb.trim().parse::<u64>().ok())
        .map_or(0, |kb| kb * 1024)
}
