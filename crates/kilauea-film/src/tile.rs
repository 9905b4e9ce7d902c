use kilauea_scene::DataWindow;

use crate::aov::Rule;
use crate::{Aov, PixelSample};

/// The part of a film that one engine thread fills at a time.
#[derive(Debug)]
pub struct Tile {
    bounds: DataWindow,
    beauty: Vec<BeautySum>,
    /// Sum of squared deviations of the luminance from its mean; empty unless asked for.
    luminance_m2: Vec<f64>,
    /// Layers with storage of their own.
    layers: Vec<LayerBuffer>,
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

impl BeautySum {
    fn mean_luminance(&self) -> f64 {
        match self.n_samples {
            0 => 0.0,
            n => luminance(self.rgb) / f64::from(n),
        }
    }
}

#[derive(Debug)]
struct LayerBuffer {
    aov: Aov,
    n_channels: usize,
    /// `n_channels` values per pixel.
    values: Vec<f32>,
}

impl Tile {
    pub(crate) fn new(bounds: DataWindow, aovs: &[Aov]) -> Self {
        let [width, height] = size(bounds);
        let n_pixels = width * height;
        let layers: Vec<LayerBuffer> = aovs
            .iter()
            .filter_map(|&aov| {
                let initial = match aov.row().rule {
                    Rule::Mean { .. } => 0.0,
                    Rule::Nearest { empty, .. } => empty,
                    Rule::Statistic => return None,
                };
                let n_channels = aov.channels().len();
                Some(LayerBuffer {
                    aov,
                    n_channels,
                    values: vec![initial; n_channels * n_pixels],
                })
            })
            .collect();
        let any_nearest = layers
            .iter()
            .any(|layer| matches!(layer.aov.row().rule, Rule::Nearest { .. }));
        Self {
            bounds,
            beauty: vec![BeautySum::default(); n_pixels],
            luminance_m2: if aovs.contains(&Aov::Variance) {
                vec![0.0; n_pixels]
            } else {
                Vec::new()
            },
            layers,
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
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn add(&mut self, pixel_idx: usize, sample: &PixelSample) {
        // Drop light that is not a number.
        let mut is_valid = sample.beauty.is_finite() && sample.alpha.is_finite();
        let black;
        let sample = if is_valid {
            sample
        } else {
            black = sample.without_light();
            &black
        };

        // Add to the beauty, and to the spread of its luminance (Welford 1962).
        let sum = &mut self.beauty[pixel_idx];
        let mean_before = sum.mean_luminance();
        let rgb = sample.beauty.to_array().map(f64::from);
        for (sum, value) in sum.rgb.iter_mut().zip(rgb) {
            *sum += value;
        }
        if sample.alpha.is_finite() {
            sum.alpha += f64::from(sample.alpha);
        }
        sum.n_samples += 1;
        if let Some(m2) = self.luminance_m2.get_mut(pixel_idx) {
            let y = luminance(rgb);
            *m2 += (y - mean_before) * (y - sum.mean_luminance());
        }

        // Is this sample the one that layers which cannot be averaged show?
        let is_nearest = match self.nearest_sq.get_mut(pixel_idx) {
            Some(nearest_sq) if sample.offset_sq < *nearest_sq => {
                *nearest_sq = sample.offset_sq;
                true
            }
            _ => false,
        };

        for layer in &mut self.layers {
            let range = pixel_idx * layer.n_channels..(pixel_idx + 1) * layer.n_channels;
            let pixel = &mut layer.values[range];
            match layer.aov.row().rule {
                // A running mean: exact for a constant, however many samples.
                Rule::Mean { read } => {
                    for (mean, value) in pixel.iter_mut().zip(read(sample)) {
                        is_valid &= value.is_finite();
                        let value = if value.is_finite() { value } else { 0.0 };
                        *mean += (value - *mean) / sum.n_samples as f32;
                    }
                }
                Rule::Nearest { read, empty } if is_nearest => {
                    for (shown, value) in pixel.iter_mut().zip(read(sample)) {
                        is_valid &= !value.is_nan();
                        *shown = if value.is_nan() { empty } else { value };
                    }
                }
                Rule::Nearest { .. } | Rule::Statistic => {}
            }
        }
        self.n_invalid += u64::from(!is_valid);
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

    /// Estimated variance of a pixel's mean luminance: the sample variance over the number of
    /// samples. Infinite below two samples, `None` unless the film has [`Aov::Variance`].
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
                    let n = layer.n_channels;
                    out.copy_from_slice(&layer.values[pixel_idx * n..(pixel_idx + 1) * n]);
                }
            }
        }
    }

    /// Bytes of all per-pixel storage.
    pub(crate) fn n_bytes(&self) -> usize {
        size_of_val(self.beauty.as_slice())
            + size_of_val(self.luminance_m2.as_slice())
            + size_of_val(self.nearest_sq.as_slice())
            + self
                .layers
                .iter()
                .map(|layer| size_of_val(layer.values.as_slice()))
                .sum::<usize>()
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
