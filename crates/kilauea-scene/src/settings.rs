use serde::{Deserialize, Serialize};

use crate::PhotonSettings;

/// Settings of one frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RenderSettings {
    /// Display window in pixels: width, height.
    pub resolution: [u32; 2],
    /// Width of a pixel over its height.
    pub pixel_aspect_ratio: f32,
    /// Pixels to render; the whole display window when absent.
    pub data_window: Option<DataWindow>,
    /// Samples in every pixel, or at most where `noise` is set.
    pub samples_per_pixel: u32,
    /// Relative error, as the root of relMSE, below which parts of the picture get no more samples;
    /// none where all get all.
    #[serde(default)]
    pub noise: Option<f32>,
    /// Bounces after the camera ray; 0 is emission alone.
    pub max_depth: u32,
    /// How paths find light.
    #[serde(default)]
    pub integrator: Integrator,
    /// How light is found that surfaces throw on each other.
    #[serde(default)]
    pub gi: GlobalIllumination,
    /// Of what is found by photons.
    #[serde(default)]
    pub photons: PhotonSettings,
    /// Makes another, equally good image.
    pub seed: u32,
    /// Pixel filter.
    pub filter: FilterKind,
    /// Filter radius in pixels; the filter's own default when absent.
    pub filter_radius: Option<f32>,
    /// Engine threads; 0 is one per core.
    pub threads: u32,
    /// Stop starting new samples this many seconds after the render call.
    pub time_limit_secs: Option<f64>,
    /// Names of the layers to write besides the beauty; all when empty.
    pub aovs: Vec<String>,
    /// Bytes of texture tiles kept in memory.
    pub texture_memory_bytes: u64,
    /// How questions of shades are answered.
    pub shading: Shading,
    /// Bytes that shades waiting for answers may take, where they wait.
    pub shade_memory_bytes: u64,
    /// Which unused work is skipped; false runs the general code (tests, benchmarks). With the
    /// integrator `path` the image is the same; `kilauea` uses what it learns whether it pays or not.
    pub specialize: bool,
    /// Features whose general code runs even if they are not in use, by their names in the
    /// statistics' `skipped` (tests, benchmarks).
    #[serde(default)]
    pub general: Vec<String>,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            resolution: [640, 360],
            pixel_aspect_ratio: 1.0,
            data_window: None,
            samples_per_pixel: 64,
            noise: None,
            max_depth: 16,
            integrator: Integrator::default(),
            gi: GlobalIllumination::default(),
            photons: PhotonSettings::default(),
            seed: 0,
            filter: FilterKind::BlackmanHarris,
            filter_radius: None,
            threads: 0,
            time_limit_secs: None,
            aovs: Vec::new(),
            texture_memory_bytes: 1 << 30,
            shading: Shading::Inline,
            shade_memory_bytes: 64 << 20,
            specialize: true,
            general: Vec::new(),
        }
    }
}

/// Pixels from `min` up to and without `max`, y down, (0, 0) at the upper left of the display
/// window; may reach outside of it (overscan).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DataWindow {
    /// First column and row.
    pub min: [i32; 2],
    /// One past the last column and row.
    pub max: [i32; 2],
}

impl DataWindow {
    /// Whether there is a pixel in that column and row.
    pub fn contains(&self, [column, row]: [i32; 2]) -> bool {
        let [columns, rows] = [0, 1].map(|axis| self.min[axis]..self.max[axis]);
        columns.contains(&column) && rows.contains(&row)
    }
}

/// How paths find light. The expected image is the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// By what surfaces and lights are like alone.
    Path,
    /// By what earlier paths found as well, where that pays.
    #[default]
    Kilauea,
}

/// How light is found that surfaces throw on each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GlobalIllumination {
    /// By paths from the camera: right in expectation with any number of samples.
    #[default]
    Exact,
    /// By photons as well, where that pays: caustics, and by the integrator `kilauea` irradiance where
    /// paths meet a second rough surface. What is blurred of it vanishes with the number of samples.
    Consistent,
}

/// Pixel filters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FilterKind {
    /// Constant; radius 0.5 by default.
    Box,
    /// Gaussian with a standard deviation of a third of its radius; radius 1.5 by default.
    Gaussian,
    /// Blackman-Harris; radius 1.5 by default, which is what Cycles makes of its default filter
    /// width of 1.5.
    BlackmanHarris,
}

/// How the questions of shades are answered. The image is the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shading {
    /// Within the call.
    Inline,
    /// In batches by other threads, while the shade waits.
    Queued,
    /// Like `Queued`, and nothing but bytes crosses between the threads.
    Bytes,
}
