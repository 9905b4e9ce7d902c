//! A frame put together from units that are rendered elsewhere.

use kilauea_film::Film;
use kilauea_scene::RenderSettings;

use crate::RenderError;
use crate::job::{RenderResult, empty_film};
use crate::noise::n_pixels_below;
use crate::passes::Passes;
use crate::report::count_warnings;
use crate::stats::RenderStats;
use crate::units::{Tally, TileResult, UnitError};

/// The results of a frame's units so far.
pub struct CollectedFrame {
    film: Film,
    passes: Passes,
    n_samples_planned: u64,
    n_samples: u64,
    stops_early: bool,
    tally: Tally,
}

impl CollectedFrame {
    /// A frame without results.
    pub fn new(settings: &RenderSettings) -> Result<Self, RenderError> {
        let film = empty_film(settings)?;
        Ok(Self {
            passes: Passes::new(&film, settings.samples_per_pixel),
            n_samples_planned: film.n_pixels() * u64::from(settings.samples_per_pixel),
            film,
            n_samples: 0,
            stops_early: settings.noise.is_some(),
            tally: Tally::default(),
        })
    }

    /// Tiles of the film.
    pub fn n_tiles(&self) -> u32 {
        self.passes.n_tiles()
    }

    /// Passes over each tile.
    pub fn n_passes(&self) -> u32 {
        self.passes.n_passes()
    }

    /// Passes over a tile whose results are here.
    ///
    /// # Panics
    /// If there is no such tile.
    pub fn n_passes_done(&self, tile: u32) -> u32 {
        self.passes.n_done_of(tile)
    }

    /// The sums of a tile so far.
    ///
    /// # Panics
    /// If there is no such tile.
    pub fn sums(&self, tile: u32) -> Vec<u8> {
        self.film.tile(tile as usize).sums()
    }

    /// Fraction of the samples that are here.
    pub fn progress(&self) -> f64 {
        self.n_samples as f64 / self.n_samples_planned.max(1) as f64
    }

    /// Puts a result into the film. It must follow on what is there of its tile.
    pub fn put(&mut self, result: TileResult) -> Result<(), UnitError> {
        let TileResult { unit, sums, tally } = result;
        self.passes.check(&unit)?;
        self.passes.check_turn(&unit)?;
        self.film.tile(unit.tile as usize).set_sums(&sums)?;
        self.passes.set_done(unit.tile, unit.passes.end);
        let n_pixels = u64::from(self.passes.n_pixels(unit.tile));
        self.n_samples += n_pixels * self.passes.samples(&unit.passes).len() as u64;
        self.tally.counts.add(tally.counts);
        self.tally.faults.merge(tally.faults);
        Ok(())
    }

    /// The frame as far as it is. `report` is what one that rendered units of it says of itself:
    /// everyone prepares the same.
    pub fn into_result(self, report: RenderStats) -> RenderResult {
        let film = self.film;
        let Tally { counts, faults } = self.tally;
        let samples = film.n_samples();
        let full_passes = self.passes.n_done();
        let pixels_stopped = if self.stops_early {
            n_pixels_below(&film, self.passes.samples(&(0..full_passes)).end)
        } else {
            0
        };
        let mut stats = RenderStats {
            samples_per_pixel: samples as f64 / film.n_pixels().max(1) as f64,
            samples,
            pixels_stopped,
            invalid_samples: film.n_invalid(),
            invalid_samples_by_step: faults.counts(),
            invalid_rays: report.invalid_rays + counts.invalid,
            is_complete: full_passes == self.passes.n_passes(),
            full_passes,
            ..report
        };
        stats.rays.camera += counts.camera;
        stats.rays.shadow += counts.shadow;
        stats.rays.indirect += counts.indirect;
        stats.warnings.extend(count_warnings(counts));
        stats.warnings.extend(faults.lines());
        RenderResult { film, stats }
    }
}
