//! How the samples of a frame are divided into roots, the units that engine threads take.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use kilauea_film::Film;
use kilauea_scene::DataWindow;

use crate::units::{Unit, UnitError};

/// Edge length of a tile in pixels: small enough that two threads finish a small picture together,
/// large enough that a tile's rays stay close.
pub(crate) const TILE_SIZE: u32 = 32;
/// Most samples that a pixel gets in one pass.
const MAX_PASS_SAMPLES: u32 = 16;

/// Passes over the tiles of a film, and how far they are.
pub(crate) struct Passes {
    /// First sample of each pass, and the total at the end.
    starts: Vec<u32>,
    tiles: Vec<TileProgress>,
}

struct TileProgress {
    bounds: DataWindow,
    /// Sum of the pixels that each pass did.
    pixels_done: AtomicU64,
    /// The same, as far as others know of it.
    pixels_told: AtomicU64,
}

/// Some pixels of a tile in one pass or several: what a root computes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct PixelRun {
    pub(crate) passes: Range<u32>,
    pub(crate) tile: u32,
    /// Numbers within the tile. Empty where a tile at the film's edge has no such pixels.
    pub(crate) pixels: Range<u32>,
}

impl Passes {
    pub(crate) fn new(film: &Film, samples_per_pixel: u32) -> Self {
        let tile = |idx| TileProgress {
            bounds: film.tile(idx).bounds(),
            pixels_done: AtomicU64::new(0),
            pixels_told: AtomicU64::new(0),
        };
        Self {
            starts: pass_starts(samples_per_pixel),
            tiles: (0..film.n_tiles()).map(tile).collect(),
        }
    }

    pub(crate) fn n_passes(&self) -> u32 {
        self.starts.len() as u32 - 1
    }

    pub(crate) fn n_tiles(&self) -> u32 {
        self.tiles.len() as u32
    }

    /// Samples that each pixel gets in some passes.
    pub(crate) fn samples(&self, passes: &Range<u32>) -> Range<u32> {
        self.starts[passes.start as usize]..self.starts[passes.end as usize]
    }

    pub(crate) fn n_pixels(&self, tile: u32) -> u32 {
        self.tiles[tile as usize].n_pixels()
    }

    /// The root with that number among those of `passes`, each of up to `n_pixels` pixels: tile by
    /// tile, then pass by pass.
    pub(crate) fn run(&self, passes: &Range<u32>, n_pixels: u32, number: u64) -> Option<PixelRun> {
        let n_tiles = self.tiles.len() as u64;
        let runs_per_tile = u64::from((TILE_SIZE * TILE_SIZE).div_ceil(n_pixels));
        let tile_pass = number / runs_per_tile;
        let pass = u64::from(passes.start) + tile_pass.checked_div(n_tiles)?;
        if pass >= u64::from(passes.end) {
            return None;
        }
        let pass = pass as u32;
        let tile = (tile_pass % n_tiles) as u32;
        let n_pixels_of_tile = self.tiles[tile as usize].n_pixels();
        let first = (number % runs_per_tile) as u32 * n_pixels;
        Some(PixelRun {
            passes: pass..pass + 1,
            tile,
            pixels: first.min(n_pixels_of_tile)..(first + n_pixels).min(n_pixels_of_tile),
        })
    }

    /// Column and row of a pixel.
    pub(crate) fn pixel(&self, tile: u32, pixel: u32) -> [i32; 2] {
        let DataWindow { min, max } = self.tiles[tile as usize].bounds;
        let width = max[0] - min[0];
        let pixel = pixel as i32;
        [min[0] + pixel % width, min[1] + pixel / width]
    }

    /// Width of a tile in pixels.
    pub(crate) fn tile_width(&self, tile: u32) -> u32 {
        let DataWindow { min, max } = self.tiles[tile as usize].bounds;
        (max[0] - min[0]) as u32
    }

    /// Notes that `n_pixels` pixels of a tile are through a pass. If they are its last, `at_end` is
    /// called before others know of it.
    pub(crate) fn note_done(&self, tile: u32, n_pixels: u32, at_end: impl FnOnce()) {
        let tile = &self.tiles[tile as usize];
        let n_new = u64::from(n_pixels);
        let n_done = tile.pixels_done.fetch_add(n_new, Ordering::AcqRel) + n_new;
        if n_new > 0 && n_done.is_multiple_of(u64::from(tile.n_pixels())) {
            at_end();
        }
        tile.pixels_told.fetch_add(n_new, Ordering::Release);
    }

    /// Notes that a tile is through that many passes, and through no more.
    pub(crate) fn set_done(&self, tile: u32, n_passes: u32) {
        let tile = &self.tiles[tile as usize];
        let n_pixels = u64::from(tile.n_pixels()) * u64::from(n_passes);
        tile.pixels_done.store(n_pixels, Ordering::Release);
        tile.pixels_told.store(n_pixels, Ordering::Release);
    }

    /// Passes over a tile that are done.
    pub(crate) fn n_done_of(&self, tile: u32) -> u32 {
        self.tiles[tile as usize].passes_done()
    }

    /// Whether all passes over a tile before `pass` are done.
    pub(crate) fn is_turn_of(&self, pass: u32, tile: u32) -> bool {
        self.n_done_of(tile) >= pass
    }

    /// Refuses a unit of another frame.
    pub(crate) fn check(&self, unit: &Unit) -> Result<(), UnitError> {
        let Unit { tile, passes } = unit;
        if *tile < self.n_tiles() && passes.start < passes.end && passes.end <= self.n_passes() {
            return Ok(());
        }
        Err(UnitError::Unknown {
            tile: *tile,
            passes: passes.clone(),
        })
    }

    /// Refuses a unit that does not follow on the passes that its tile is through.
    pub(crate) fn check_turn(&self, unit: &Unit) -> Result<(), UnitError> {
        let done = self.n_done_of(unit.tile);
        if done == unit.passes.start {
            return Ok(());
        }
        Err(UnitError::OutOfTurn {
            tile: unit.tile,
            done,
            start: unit.passes.start,
        })
    }

    /// Passes over the whole film that are done.
    pub(crate) fn n_done(&self) -> u32 {
        let done = self.tiles.iter().map(TileProgress::passes_done);
        done.min().unwrap_or(self.n_passes())
    }
}

impl TileProgress {
    fn n_pixels(&self) -> u32 {
        let DataWindow { min, max } = self.bounds;
        ((max[0] - min[0]) * (max[1] - min[1])) as u32
    }

    fn passes_done(&self) -> u32 {
        (self.pixels_told.load(Ordering::Acquire) / u64::from(self.n_pixels())) as u32
    }
}

/// Samples that a pixel gets in the largest pass.
pub(crate) fn largest_pass(samples_per_pixel: u32) -> u32 {
    let starts = pass_starts(samples_per_pixel);
    let sizes = starts.windows(2).map(|pass| pass[1] - pass[0]);
    sizes.max().unwrap_or(0)
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

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_film::FilmSettings;

    #[test]
    fn passes_double_and_add_up() {
        assert_eq!(pass_starts(1), [0, 1]);
        assert_eq!(pass_starts(5), [0, 1, 2, 4, 5]);
        assert_eq!([0, 1, 5, 100].map(largest_pass), [0, 1, 2, 16]);
        assert_eq!(pass_starts(64), [0, 1, 2, 4, 8, 16, 32, 48, 64]);
    }

    fn film() -> Film {
        Film::new(FilmSettings {
            resolution: [40, 33],
            data_window: DataWindow {
                min: [-2, 0],
                max: [40, 33],
            },
            tile_size: TILE_SIZE,
            aovs: Vec::new(),
            tracks_variance: false,
        })
    }

    #[test]
    fn runs_cover_each_pixel_once_a_pass_whatever_their_length() {
        let film = film();
        for n_pixels in [1, 100, TILE_SIZE * TILE_SIZE] {
            let passes = Passes::new(&film, 4);
            let mut pixels: Vec<Vec<[i32; 2]>> = vec![Vec::new(); 2];
            for run in (0..).map_while(|number| passes.run(&(1..3), n_pixels, number)) {
                let of_pass = &mut pixels[run.passes.start as usize - 1];
                of_pass.extend(run.pixels.map(|pixel| passes.pixel(run.tile, pixel)));
            }
            let expected: Vec<_> = (0..film.n_tiles())
                .flat_map(|tile| film.tile(tile).pixels())
                .collect();
            assert_eq!(pixels, [expected.clone(), expected]);
        }
    }

    #[test]
    fn a_pass_is_done_with_its_last_pixel() {
        let film = film();
        let passes = Passes::new(&film, 4);
        let n_pixels = |tile: u32| film.tile(tile as usize).n_pixels() as u32;
        let n_tiles = film.n_tiles() as u32;
        for tile in 1..n_tiles {
            passes.note_done(tile, n_pixels(tile), || ());
        }
        let mut is_over = false;
        passes.note_done(0, n_pixels(0) - 1, || is_over = true);
        assert!(!passes.is_turn_of(1, 0) && passes.is_turn_of(1, 1));
        assert!(!is_over && passes.n_done() == 0);
        passes.note_done(0, 1, || is_over = true);
        assert!(passes.is_turn_of(1, 0) && !passes.is_turn_of(2, 0));
        assert!(is_over && passes.n_done() == 1);
    }
}
