mod sums;

use std::ops::Range;

use kilauea_math::each_of_three;
use kilauea_scene::DataWindow;

use crate::aov::Rule;
use crate::{Aov, PixelSample};

pub use sums::SumsError;

/// The part of a film that one engine thread fills at a time.
#[derive(Debug)]
pub struct Tile {
    bounds: DataWindow,
    beauty: Vec<BeautySum>,
    /// Sum of squared deviations of the luminance from its mean; empty unless asked for.
    luminance_m2: Vec<f64>,
    /// Layers with storage of their own.
    layers: Vec<LayerSlot>,
    /// Values of those layers, pixel after pixel.
    values: Vec<f32>,
    /// Squared distance of the sample that the nearest-sample layers show; empty without such.
    nearest_sq: Vec<f32>,
    n_invalid: u64,
}

/// Sums in f64: after 2^16 samples of any brightness no digit of the f32 image is lost.
#[derive(Clone, Copy, Debug, Default)]
struct BeautySum {
    rgb: [f64; 3],
    alpha: f64,
    n_samples: u32,
}

/// Where a layer is among the values of a pixel.
#[derive(Clone, Debug)]
struct LayerSlot {
    aov: Aov,
    rule: Rule,
    channels: Range<usize>,
}

impl Tile {
    pub(crate) fn new(bounds: DataWindow, aovs: &[Aov], tracks_variance: bool) -> Self {
        let [width, height] = size(bounds);
        let n_pixels = width * height;
        let mut layers = Vec::new();
        let mut empty_pixel = Vec::new();
        for &aov in aovs {
            let rule = aov.row().rule;
            if matches!(rule, Rule::Statistic) {
                continue;
            }
            let start = empty_pixel.len();
            let end = start + aov.channels().len();
            empty_pixel.resize(end, rule.empty());
            layers.push(LayerSlot {
                aov,
                rule,
                channels: start..end,
            });
        }
        let any_nearest = layers
            .iter()
            .any(|layer| matches!(layer.rule, Rule::Nearest { .. }));
        Self {
            bounds,
            beauty: vec![BeautySum::default(); n_pixels],
            luminance_m2: if tracks_variance {
                vec![0.0; n_pixels]
            } else {
                Vec::new()
            },
            layers,
            values: empty_pixel.repeat(n_pixels),
            nearest_sq: if any_nearest {
                vec![f32::INFINITY; n_pixels]
            } else {
                Vec::new()
            },
            n_invalid: 0,
        }
    }

    /// The pixels of this tile.
    pub fn bounds(&self) -> DataWindow {
        self.bounds
    }

    /// How many pixels there are.
    pub fn n_pixels(&self) -> usize {
        self.beauty.len()
    }

    /// Column and row of each pixel; the n-th has the index n in the other calls.
    pub fn pixels(&self) -> impl Iterator<Item = [i32; 2]> + use<> {
        let DataWindow { min, max } = self.bounds;
        (min[1]..max[1]).flat_map(move |y| (min[0]..max[0]).map(move |x| [x, y]))
    }

    /// Adds a sample to a pixel. Light that is NaN or infinite is counted and taken as black.
    /// Returns whether all was finite that the film records.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn add(&mut self, pixel_idx: usize, sample: &PixelSample) -> bool {
        // Drop light that is not a number.
        let mut is_valid = sample.beauty.is_finite() && sample.alpha.is_finite();
        let black;
        let sample = if is_valid {
            sample
        } else {
            black = sample.without_light();
            &black
        };

        // Add to the spread of the luminance (Welford 1962) and to the beauty.
        let sum = &mut self.beauty[pixel_idx];
        let rgb = each_of_three(sample.beauty.to_array(), f64::from);
        sum.n_samples += 1;
        if let Some(m2) = self.luminance_m2.get_mut(pixel_idx) {
            let y = luminance(rgb);
            let n_before = f64::from(sum.n_samples - 1);
            let mean_before = luminance(sum.rgb) / n_before.max(1.0);
            let mean = mean_before + (y - mean_before) / f64::from(sum.n_samples);
            *m2 += (y - mean_before) * (y - mean);
        }
        for (sum, value) in sum.rgb.iter_mut().zip(rgb) {
            *sum += value;
        }
        if sample.alpha.is_finite() {
            sum.alpha += f64::from(sample.alpha);
        }

        // Is this sample the one that layers which cannot be averaged show?
        let is_nearest = match self.nearest_sq.get_mut(pixel_idx) {
            Some(nearest_sq) if sample.offset_sq < *nearest_sq => {
                *nearest_sq = sample.offset_sq;
                true
            }
            _ => false,
        };

        let weight = 1.0 / sum.n_samples as f32;
        let stride = self.values.len() / self.beauty.len();
        let pixel = &mut self.values[pixel_idx * stride..(pixel_idx + 1) * stride];
        for layer in &self.layers {
            let values = &mut pixel[layer.channels.clone()];
            match layer.rule {
                // A running mean: exact for a constant, however many samples.
                Rule::Mean { read } => {
                    for (mean, value) in values.iter_mut().zip(read(sample)) {
                        is_valid &= value.is_finite();
                        let value = if value.is_finite() { value } else { 0.0 };
                        *mean += (value - *mean) * weight;
                    }
                }
                Rule::Nearest { read, empty } if is_nearest => {
                    for (shown, value) in values.iter_mut().zip(read(sample)) {
                        is_valid &= !value.is_nan();
                        *shown = if value.is_nan() { empty } else { value };
                    }
                }
                Rule::Nearest { .. } | Rule::Statistic => {}
            }
        }
        self.n_invalid += u64::from(!is_valid);
        is_valid
    }

    /// Samples of a pixel so far.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn n_samples(&self, pixel_idx: usize) -> u32 {
        self.beauty[pixel_idx].n_samples
    }

    /// Mean red, green, blue and opacity of a pixel so far; zero without samples.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn beauty(&self, pixel_idx: usize) -> [f32; 4] {
        let sum = &self.beauty[pixel_idx];
        let n = f64::from(sum.n_samples.max(1));
        let [r, g, b] = sum.rgb;
        [r, g, b, sum.alpha].map(|total| (total / n) as f32)
    }

    /// Mean luminance of a pixel so far; zero without samples.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn luminance(&self, pixel_idx: usize) -> f32 {
        let sum = &self.beauty[pixel_idx];
        (luminance(sum.rgb) / f64::from(sum.n_samples.max(1))) as f32
    }

    /// Estimated variance of a pixel's mean luminance: the sample variance over the number of
    /// samples. Infinite below two samples, `None` unless the film tracks it.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn variance(&self, pixel_idx: usize) -> Option<f32> {
        let n = f64::from(self.n_samples(pixel_idx));
        self.luminance_m2.get(pixel_idx).map(|m2| {
            if n < 2.0 {
                f32::INFINITY
            } else {
                (m2.max(0.0) / (n * (n - 1.0))) as f32
            }
        })
    }

    /// Samples with light that was not a number.
    pub fn n_invalid(&self) -> u64 {
        self.n_invalid
    }

    /// Puts the values of a layer's pixel into `out`, one per channel.
    pub(crate) fn resolve(&self, aov: Aov, pixel_idx: usize, out: &mut [f32]) {
        match aov {
            Aov::Beauty => out.copy_from_slice(&self.beauty(pixel_idx)),
            Aov::SampleCount => out[0] = self.n_samples(pixel_idx) as f32,
            Aov::Variance => out[0] = self.variance(pixel_idx).unwrap_or(f32::INFINITY),
            _ => {
                if let Some(layer) = self.layers.iter().find(|layer| layer.aov == aov) {
                    let stride = self.values.len() / self.beauty.len();
                    let pixel = &self.values[pixel_idx * stride..(pixel_idx + 1) * stride];
                    out.copy_from_slice(&pixel[layer.channels.clone()]);
                }
            }
        }
    }

    /// Bytes of all per-pixel storage.
    pub(crate) fn n_bytes(&self) -> usize {
        size_of_val(self.beauty.as_slice())
            + size_of_val(self.luminance_m2.as_slice())
            + size_of_val(self.nearest_sq.as_slice())
            + size_of_val(self.values.as_slice())
    }
}

/// Width and height in pixels; zero for a window that is inside out.
pub(crate) fn size(window: DataWindow) -> [usize; 2] {
    [0, 1].map(|axis| {
        let length = i64::from(window.max[axis]) - i64::from(window.min[axis]);
        length.max(0) as usize
    })
}

/// Rec. 709 luminance.
fn luminance(rgb: [f64; 3]) -> f64 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}
