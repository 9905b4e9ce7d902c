//! The pixels of units as roots, where what rays meet is asked of others: while some wait for answers,
//! those of the next units go on.

use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::frame::Frame;
use crate::passes::PixelRun;
use crate::program::Sampled;
use crate::units::{Availability, UnitSource};

/// Hands out the pixels of units, and the units once all their pixels are done.
pub(crate) struct UnitPixels<'f> {
    frame: &'f Frame,
    source: &'f dyn UnitSource,
    passes: Range<u32>,
    open: Mutex<Vec<OpenUnit>>,
}

/// A unit of which not all is done. There is no other of its tile.
struct OpenUnit {
    /// Pixels that nobody has begun.
    rest: Range<u32>,
    /// Pixels that were begun and have not ended.
    n_under_way: u32,
    /// What those did that have ended.
    sampled: Sampled,
}

impl<'f> UnitPixels<'f> {
    /// Of units whose passes start within `passes`.
    pub(crate) fn new(frame: &'f Frame, source: &'f dyn UnitSource, passes: Range<u32>) -> Self {
        Self {
            frame,
            source,
            passes,
            open: Mutex::default(),
        }
    }

    /// Whether there is something to begin, or will never be. Threads do not wait for more units: what
    /// they have under way would wait too.
    pub(crate) fn has_next(&self) -> bool {
        self.has_ended()
            || self.lock().iter().any(|unit| !unit.rest.is_empty())
            || self.source.look(&self.passes) != Availability::NotYet
    }

    /// A pixel in all passes of its unit, one after the other; none of any tile where others were
    /// faster. `None` where there are no more, or no time.
    pub(crate) fn next(&self) -> Option<PixelRun> {
        if self.has_ended() {
            return None;
        }
        let mut open = self.lock();
        loop {
            if let Some(unit) = open.iter_mut().find(|unit| !unit.rest.is_empty()) {
                return unit.begin_pixel();
            }
            match self.source.look(&self.passes) {
                Availability::Over => return None,
                Availability::NotYet => return Some(PixelRun::default()),
                Availability::Ready => {
                    let taken = self.frame.take_unit(self.source, &self.passes);
                    open.extend(taken.map(OpenUnit::new));
                }
            }
        }
    }

    /// Notes that a pixel is done, and hands its unit over after the last.
    pub(crate) fn end_pixel(&self, sampled: Sampled) {
        let mut open = self.lock();
        let of_tile = |unit: &OpenUnit| unit.sampled.run.tile == sampled.run.tile;
        let is_pixel = !sampled.run.passes.is_empty();
        let Some(at) = open.iter().position(of_tile).filter(|_| is_pixel) else {
            return;
        };
        open[at].end_pixel(sampled);
        if open[at].is_done() {
            let unit = open.swap_remove(at);
            drop(open);
            self.frame.finish(unit.sampled);
        }
    }

    pub(crate) fn is_cancelled(&self) -> bool {
        self.frame.is_cancelled()
    }

    fn has_ended(&self) -> bool {
        self.frame.is_over() || self.frame.is_late()
    }

    fn lock(&self) -> MutexGuard<'_, Vec<OpenUnit>> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl OpenUnit {
    fn new(run: PixelRun) -> Self {
        Self {
            rest: run.pixels.clone(),
            n_under_way: 0,
            sampled: Sampled::new(run),
        }
    }

    fn begin_pixel(&mut self) -> Option<PixelRun> {
        let pixel = self.rest.next()?;
        self.n_under_way += 1;
        Some(PixelRun {
            pixels: pixel..pixel + 1,
            ..self.sampled.run.clone()
        })
    }

    fn end_pixel(&mut self, of_pixel: Sampled) {
        self.n_under_way -= 1;
        self.sampled.n_pixels += of_pixel.n_pixels;
        self.sampled.counts.add(of_pixel.counts);
        if let Some(faults) = of_pixel.faults {
            self.sampled.faults.get_or_insert_default().merge(*faults);
        }
    }

    fn is_done(&self) -> bool {
        self.rest.is_empty() && self.n_under_way == 0
    }
}
