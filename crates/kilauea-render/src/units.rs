//! A frame in units: work that may be handed out to anyone, and to more than one.

use std::ops::Range;

use kilauea_film::SumsError;
use serde::{Deserialize, Serialize};

use crate::frame::Frame;
use crate::integrator::{Faults, RayCounts};
use crate::passes::PixelRun;
use crate::program::Sampled;
use crate::share::PathShare;

/// Some passes over a tile; one where sampling stops early, as that is decided after each. What comes of it follows from the scene, the settings and the sums of the
/// tile after the passes before, and from nothing else.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Unit {
    /// Number of the tile in the film.
    pub tile: u32,
    /// The passes.
    pub passes: Range<u32>,
}

/// What a unit's tile starts from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TileStart {
    /// No samples.
    Empty,
    /// What the same frame made of it in the passes before.
    Kept,
    /// These sums, as [`kilauea_film::Tile::sums`] gives them.
    Sums(Vec<u8>),
}

/// A unit to render.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnitOrder {
    /// The unit.
    pub unit: Unit,
    /// Where it starts.
    pub start: TileStart,
}

/// What a unit came to.
#[derive(Clone, Debug, PartialEq)]
pub struct TileResult {
    /// The unit.
    pub unit: Unit,
    /// The sums of its tile afterwards.
    pub sums: Vec<u8>,
    /// What was counted on the way.
    pub tally: Tally,
}

/// What was counted while rendering a unit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tally {
    pub(crate) counts: RayCounts,
    pub(crate) faults: Faults<String>,
}

impl Tally {
    /// Rays traced for it.
    pub fn n_rays(&self) -> u64 {
        self.counts.camera + self.counts.shadow + self.counts.indirect
    }
}

/// Whether there is work to take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Availability {
    /// There is a unit to take.
    Ready,
    /// Not now.
    NotYet,
    /// Not now and never again.
    Over,
}

/// Hands out the units of a frame and takes their results. Called by many threads at once.
pub trait UnitSource: Send + Sync {
    /// Whether there are units whose passes start within `passes`.
    fn look(&self, passes: &Range<u32>) -> Availability;

    /// The same. Waits for a moment where there are
    /// none yet, but not for longer: the caller has to look whether anyone still waits for the frame.
    fn wait(&self, passes: &Range<u32>) -> Availability;

    /// Takes such a unit; none where others were faster.
    fn take(&self, passes: &Range<u32>) -> Option<UnitOrder>;

    /// Takes what a unit came to.
    fn done(&self, result: TileResult);

    /// A unit cannot be rendered.
    fn refused(&self, unit: Unit, error: UnitError);

    /// A unit has come to nothing, as others had its photons no more: they are more than a pass ahead, or
    /// the time is up.
    fn dropped(&self, unit: Unit);

    /// Whether all units of these passes have results, whoever made them.
    fn has_results(&self, _passes: &Range<u32>) -> bool {
        false
    }

    /// Shares out paths that all who render the frame need; none where each follows its own.
    fn path_share(&self) -> Option<&dyn PathShare> {
        None
    }
}

/// Why a unit cannot be rendered, or its result not used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnitError {
    /// Not of this frame.
    #[error("the frame has no tile {tile} with passes {passes:?}")]
    Unknown {
        /// Tile of the unit.
        tile: u32,
        /// Its passes.
        passes: Range<u32>,
    },
    /// It does not follow on what there is of the tile.
    #[error("tile {tile} is through {done} passes, and the unit begins after {start}")]
    OutOfTurn {
        /// The tile.
        tile: u32,
        /// Passes that it is through.
        done: u32,
        /// First pass of the unit.
        start: u32,
    },
    /// No sums of this tile.
    #[error(transparent)]
    Sums(#[from] SumsError),
}

impl Frame {
    /// Waits until there is work in these passes; false where there is none or nobody waits for it.
    pub(crate) fn has_work(&self, passes: &Range<u32>) -> bool {
        let Some(source) = &self.units else {
            return true;
        };
        loop {
            if self.is_over() || self.is_late() {
                return false;
            }
            match source.wait(passes) {
                Availability::Ready => return true,
                Availability::NotYet => {}
                Availability::Over => return false,
            }
        }
    }

    /// Whether there is, or may come, work in a pass whose photons others ask for: they have them
    /// whether it is done here or not.
    pub(crate) fn begins_divided(&self, pass: u32) -> bool {
        let Some(source) = &self.units else {
            return true;
        };
        let passes = pass..pass + 1;
        if source.has_results(&passes) {
            self.photons.skip(pass);
        }
        source.look(&passes) != Availability::Over
    }

    /// Takes the next unit and puts its tile where it starts.
    pub(crate) fn begin_unit(
        &self,
        source: &dyn UnitSource,
        passes: &Range<u32>,
    ) -> Option<PixelRun> {
        while self.has_work(passes) {
            let run = self.take_unit(source, passes);
            if run.is_some() {
                return run;
            }
        }
        None
    }

    /// The same without waiting; none where others were faster or the unit is refused.
    pub(crate) fn take_unit(
        &self,
        source: &dyn UnitSource,
        passes: &Range<u32>,
    ) -> Option<PixelRun> {
        let UnitOrder { unit, start } = source.take(passes)?;
        match self.start_tile(&unit, &start) {
            Ok(()) => Some(PixelRun {
                pixels: 0..self.passes.n_pixels(unit.tile),
                passes: unit.passes,
                tile: unit.tile,
            }),
            Err(error) => {
                source.refused(unit, error);
                None
            }
        }
    }

    fn start_tile(&self, unit: &Unit, start: &TileStart) -> Result<(), UnitError> {
        self.passes.check(unit)?;
        let mut tile = self.film.tile(unit.tile as usize);
        match start {
            TileStart::Kept => return self.passes.check_turn(unit),
            TileStart::Empty => tile.clear(),
            TileStart::Sums(sums) => tile.set_sums(sums)?,
        }
        self.passes.set_done(unit.tile, unit.passes.start);
        if let Some(noise) = &self.noise {
            let n_samples = self.passes.samples(&(0..unit.passes.start)).end;
            noise.look(unit.tile, &tile, n_samples);
        }
        Ok(())
    }

    /// Hands over what a unit came to, unless it was broken off.
    pub(crate) fn end_unit(&self, source: &dyn UnitSource, sampled: Sampled) {
        let PixelRun { tile, passes, .. } = sampled.run;
        if sampled.n_pixels < self.passes.n_pixels(tile) {
            return;
        }
        if self.has_lost_photons(&passes) {
            source.dropped(Unit { tile, passes });
            return;
        }
        let geometry = &self.prepared.geometry;
        source.done(TileResult {
            sums: self.film.tile(tile as usize).sums(),
            unit: Unit { tile, passes },
            tally: Tally {
                counts: sampled.counts.into(),
                faults: sampled
                    .faults
                    .map(|faults| *faults)
                    .unwrap_or_default()
                    .named(|at| geometry.name(at)),
            },
        });
    }
}
