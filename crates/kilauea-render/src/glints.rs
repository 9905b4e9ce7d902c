//! Which pixels may see a glint, as far as that was asked.

use std::sync::atomic::{AtomicU8, Ordering};

use crate::passes::TILE_SIZE;

/// For each pixel of each tile whether it may see a glint. All who ask come to the same answer, so it
/// does not matter who is first.
pub(crate) struct GlintMap {
    pixels: Vec<AtomicU8>,
}

const NOT_ASKED: u8 = 0;
const NO: u8 = 1;
const YES: u8 = 2;

impl GlintMap {
    pub(crate) fn new(n_tiles: usize) -> Self {
        let n_pixels = n_tiles * (TILE_SIZE * TILE_SIZE) as usize;
        Self {
            pixels: (0..n_pixels).map(|_| AtomicU8::new(NOT_ASKED)).collect(),
        }
    }

    /// None where nobody has asked yet.
    pub(crate) fn get(&self, tile: u32, pixel_idx: u32) -> Option<bool> {
        match self.pixel(tile, pixel_idx).load(Ordering::Relaxed) {
            NOT_ASKED => None,
            answer => Some(answer == YES),
        }
    }

    pub(crate) fn set(&self, tile: u32, pixel_idx: u32, may_glint: bool) {
        let answer = if may_glint { YES } else { NO };
        self.pixel(tile, pixel_idx).store(answer, Ordering::Relaxed);
    }

    fn pixel(&self, tile: u32, pixel_idx: u32) -> &AtomicU8 {
        &self.pixels[(tile * TILE_SIZE * TILE_SIZE + pixel_idx) as usize]
    }
}
