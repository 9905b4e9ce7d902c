//! Adaptive sampling: where the picture is clean enough already.
//!
//! A tile is cut into blocks. After each pass over it, a block whose pixels err by no more than the
//! threshold, together with the blocks around it, gets no more samples. That depends on the tile's
//! own sums alone, so that the picture is the same on any number of threads, and wherever the tile
//! is computed.

use std::sync::atomic::{AtomicU16, Ordering};

use kilauea_film::{Film, Tile};

use crate::passes::TILE_SIZE;

/// Pixels along the side of a block.
const BLOCK_SIZE: u32 = 8;
const BLOCKS_PER_SIDE: u32 = TILE_SIZE / BLOCK_SIZE;
const N_BLOCKS: usize = (BLOCKS_PER_SIDE * BLOCKS_PER_SIDE) as usize;
/// With fewer samples, light that few of them find makes no noise yet where it was not found.
const MIN_SAMPLES: u32 = 16;
/// Added to squared luminances, so that errors of what is nearly black count for less; as in relMSE.
const DARK_SQ: f64 = 0.01;

/// What is left of the picture.
pub(crate) struct NoiseGate {
    threshold_sq: f64,
    /// By tile: a bit for each block that needs no more samples.
    settled: Vec<AtomicU16>,
}

/// A sum of squared errors over pixels.
#[derive(Clone, Copy, Default)]
struct ErrorSum {
    error_sq: f64,
    n_pixels: u32,
}

impl NoiseGate {
    /// `threshold` is the root of the relMSE that is good enough.
    pub(crate) fn new(film: &Film, threshold: f32) -> Self {
        Self {
            threshold_sq: f64::from(threshold).powi(2),
            settled: (0..film.n_tiles()).map(|_| AtomicU16::new(0)).collect(),
        }
    }

    /// Looks at a tile whose pixels have got `n_samples` samples, as far as they get any.
    pub(crate) fn look(&self, tile_idx: u32, tile: &Tile, n_samples: u32) {
        if n_samples < MIN_SAMPLES {
            return self.settled[tile_idx as usize].store(0, Ordering::Relaxed);
        }
        let bounds = tile.bounds();
        let width = (bounds.max[0] - bounds.min[0]) as u32;
        let mut blocks = [ErrorSum::default(); N_BLOCKS];
        let mut settled = 0_u16;
        for pixel_idx in 0..tile.n_pixels() {
            let block = block_of(pixel_idx as u32, width);
            blocks[block].add(relative_error_sq(tile, pixel_idx), 1);
            if tile.n_samples(pixel_idx) < n_samples {
                settled |= 1 << block;
            }
        }
        for block in 0..N_BLOCKS {
            let worse = blocks[block].mean().max(around(&blocks, block).mean());
            // NaN is not good enough.
            if worse <= self.threshold_sq {
                settled |= 1 << block;
            }
        }
        self.settled[tile_idx as usize].store(settled, Ordering::Relaxed);
    }

    /// Whether no pixel needs more samples.
    pub(crate) fn is_all_settled(&self) -> bool {
        // Blocks that a tile does not have make no noise.
        let is_settled = |tile: &AtomicU16| tile.load(Ordering::Relaxed) == u16::MAX;
        self.settled.iter().all(is_settled)
    }

    /// Whether a pixel of a tile that is so wide needs no more samples.
    pub(crate) fn is_settled(&self, tile_idx: u32, pixel_idx: u32, width: u32) -> bool {
        let settled = self.settled[tile_idx as usize].load(Ordering::Relaxed);
        settled >> block_of(pixel_idx, width) & 1 == 1
    }
}

/// Pixels with fewer samples than that.
pub(crate) fn n_pixels_below(film: &Film, n_samples: u32) -> u64 {
    let of_tile = |idx| {
        let tile = film.tile(idx);
        let has_fewer = |&pixel: &usize| tile.n_samples(pixel) < n_samples;
        (0..tile.n_pixels()).filter(has_fewer).count() as u64
    };
    (0..film.n_tiles()).map(of_tile).sum()
}

impl ErrorSum {
    fn add(&mut self, error_sq: f64, n_pixels: u32) {
        self.error_sq += error_sq;
        self.n_pixels += n_pixels;
    }

    fn mean(&self) -> f64 {
        self.error_sq / f64::from(self.n_pixels.max(1))
    }
}

/// The block of a pixel in a tile that is so wide, row by row.
fn block_of(pixel_idx: u32, width: u32) -> usize {
    let (column, row) = (pixel_idx % width, pixel_idx / width);
    (row / BLOCK_SIZE * BLOCKS_PER_SIDE + column / BLOCK_SIZE) as usize
}

/// Squared standard error of a pixel's mean luminance, relative to it.
fn relative_error_sq(tile: &Tile, pixel_idx: usize) -> f64 {
    let variance = tile.variance(pixel_idx).unwrap_or(f32::INFINITY);
    let luminance = f64::from(tile.luminance(pixel_idx));
    f64::from(variance) / (luminance * luminance + DARK_SQ)
}

/// Of a block and those beside it, as far as they are in the tile: what is rare beside a block may be
/// in it and not found yet.
fn around(blocks: &[ErrorSum; N_BLOCKS], block: usize) -> ErrorSum {
    let side = BLOCKS_PER_SIDE as usize;
    let near = |at: usize| at.saturating_sub(1)..(at + 2).min(side);
    let mut sum = ErrorSum::default();
    for row in near(block / side) {
        for column in near(block % side) {
            let ErrorSum { error_sq, n_pixels } = blocks[row * side + column];
            sum.add(error_sq, n_pixels);
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_film::{FilmSettings, PixelSample};
    use kilauea_math::Spectrum;
    use kilauea_scene::DataWindow;

    const WIDTH: u32 = 20;

    /// A tile that is narrower than others, whose pixels get 16 samples about one that are `spread`
    /// away from it in turns.
    fn film(spread: impl Fn([i32; 2]) -> f32) -> Film {
        let film = Film::new(FilmSettings {
            resolution: [WIDTH, TILE_SIZE],
            data_window: DataWindow {
                min: [0; 2],
                max: [WIDTH as i32, TILE_SIZE as i32],
            },
            tile_size: TILE_SIZE,
            aovs: Vec::new(),
            tracks_variance: true,
        });
        let mut tile = film.tile(0);
        for (idx, pixel) in tile.pixels().enumerate() {
            for i in 0..16 {
                let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
                let sample = PixelSample {
                    beauty: Spectrum::splat(1.0 + sign * spread(pixel)),
                    ..PixelSample::default()
                };
                tile.add(idx, &sample);
            }
        }
        drop(tile);
        film
    }

    /// Settled pixels after a look at a tile.
    fn settled(film: &Film, threshold: f32, n_samples: u32) -> Vec<[i32; 2]> {
        let gate = NoiseGate::new(film, threshold);
        let tile = film.tile(0);
        gate.look(0, &tile, n_samples);
        let pixels = tile.pixels().enumerate();
        pixels
            .filter(|&(idx, _)| gate.is_settled(0, idx as u32, WIDTH))
            .map(|(_, pixel)| pixel)
            .collect()
    }

    #[test]
    fn a_tile_settles_at_the_standard_error_of_its_pixels() {
        let film = film(|_| 0.4);
        // Relative to 1 + 0.01, of 16 samples.
        let error = (0.4 * 0.4 / 15.0 / 1.01_f32).sqrt();
        assert!(settled(&film, 0.99 * error, 16).is_empty());
        assert_eq!(settled(&film, 1.01 * error, 16).len(), 20 * 32);
        assert!(
            settled(&film, 1.01 * error, 15).is_empty(),
            "too few samples"
        );
    }

    #[test]
    fn blocks_beside_noise_do_not_settle() {
        let film = film(|[x, y]| if x < 8 && y < 8 { 5.0 } else { 0.0 });
        let settled = settled(&film, 0.1, 16);
        assert!(settled.iter().all(|&[x, y]| x >= 16 || y >= 16));
        assert_eq!(settled.len(), 20 * 32 - 16 * 16);
    }

    #[test]
    fn what_has_fewer_samples_stays_as_it_is() {
        let film = film(|_| 0.4);
        assert_eq!(settled(&film, 1e-3, 32).len(), 20 * 32);
    }
}
