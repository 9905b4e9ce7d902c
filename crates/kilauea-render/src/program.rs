//! The program that the dataflow engine runs: what a SPOT of a frame does, and which there are.

use std::ops::Range;
use std::sync::MutexGuard;
use std::sync::atomic::Ordering;

use kilauea_film::Tile;
use kilauea_spot::{Context, Job, Pool, Program, Runtime};

use crate::frame::Frame;
use crate::integrator::{Answer, Faults, Guide, Media, Merge, Question, RayTally};
use crate::passes::PixelRun;
use crate::samples::{PixelSampler, SampleStart};
use crate::unit_pixels::UnitPixels;

/// The program: a SPOT takes the samples of some pixels, one after the other.
///
/// A path has one ray to follow and one light to look at, so its vertices need no SPOTs of their
/// own: they would only hand on its throughput.
pub(crate) struct PixelProgram<'f, const CUTOUTS: bool, M, G, X> {
    pub(crate) sampler: PixelSampler<'f, CUTOUTS, M, G, X>,
}

/// What a SPOT did.
pub(crate) struct Sampled {
    /// Its work; the pixels are those that it left.
    pub(crate) run: PixelRun,
    pub(crate) n_pixels: u32,
    pub(crate) counts: RayTally,
    /// Of samples that were not finite; there are seldom any.
    pub(crate) faults: Option<Box<Faults>>,
}

impl Sampled {
    pub(crate) fn new(run: PixelRun) -> Self {
        Self {
            run,
            n_pixels: 0,
            counts: RayTally::default(),
            faults: None,
        }
    }
}

/// Some passes, cut into roots of so many pixels.
pub(crate) struct PassesJob<'f> {
    pub(crate) frame: &'f Frame,
    pub(crate) passes: Range<u32>,
    pub(crate) n_pixels: u32,
}

impl<const CUTOUTS: bool, M: Media, G: Guide, X: Merge> Program
    for PixelProgram<'_, CUTOUTS, M, G, X>
{
    type Work = PixelRun;
    type Output = Sampled;
    type Question = Question;
    type Answer = Answer;

    fn starter<'a, R: Runtime<'a, Self>>(
        &'a self,
        runtime: &R,
    ) -> impl Fn(PixelRun, R::Context) -> R::Started {
        let pixels = runtime.pool("a pixel's samples");
        move |run, cx| pixels.start(self.sample_pixels(run, cx))
    }
}

impl<const CUTOUTS: bool, M: Media, G: Guide, X: Merge> PixelProgram<'_, CUTOUTS, M, G, X> {
    /// Takes the samples that some pixels get, and adds them to the film.
    ///
    /// Not an `async fn`, which would keep each argument in two places while it waits; and nothing has
    /// a name that is found as easily by way of `self`.
    fn sample_pixels<C: Context<Self>>(
        &self,
        run: PixelRun,
        cx: C,
    ) -> impl Future<Output = Sampled> {
        let mut sampled = Sampled::new(run);
        let mut trail = G::Trail::default();
        async move {
            // Others may wait for these pixels.
            let _stop = StopOnPanic(self.sampler.frame);
            // Code that waits must not keep others from the tile.
            let mut held_tile = (!C::WAITS).then(|| self.tile(sampled.run.tile));
            #[allow(clippy::while_let_on_iterator, reason = "a `for` keeps a reference")]
            while let Some(pixel_idx) = sampled.run.pixels.next() {
                if self.sampler.frame.is_over() {
                    break;
                }
                sampled.n_pixels += 1;
                if self.sampler.frame.is_settled(sampled.run.tile, pixel_idx) {
                    continue;
                }
                let pixel = self.sampler.pixel(sampled.run.tile, pixel_idx);
                let guide = &self.sampler.integrator.guide;
                guide.begin(&mut trail, pixel.position);
                for sample_idx in self.sampler.frame.passes.samples(&sampled.run.passes) {
                    let SampleStart { ray, sampler, view } = self.sampler.start(&pixel, sample_idx);
                    let is_finite = {
                        let path = self.sampler.integrator.start(ray);
                        let counts = &mut sampled.counts;
                        let mut found = (self.sampler.integrator)
                            .trace(path, sampler, counts, &mut trail, &cx)
                            .await;
                        let merge = &self.sampler.integrator.merge;
                        merge.show(pixel.position, sample_idx, &mut found);
                        let sample = self.sampler.finish(&view, &found);
                        let pixel_idx = pixel_idx as usize;
                        match &mut held_tile {
                            Some(tile) => tile.add(pixel_idx, &sample),
                            None => self.tile(sampled.run.tile).add(pixel_idx, &sample),
                        }
                    };
                    if !is_finite {
                        // In a box, as room for it would be in the state of every path.
                        let fault = self.sampler.find_fault(&pixel, sample_idx, &cx);
                        let (id, fault) = Box::pin(fault).await;
                        sampled.faults.get_or_insert_default().add(id, fault);
                    }
                }
            }
            sampled
        }
    }

    fn tile(&self, tile: u32) -> MutexGuard<'_, Tile> {
        self.sampler.frame.film.tile(tile as usize)
    }
}

impl PassesJob<'_> {
    /// The pixels to sample next. `None` where there are no more, or no time.
    pub(crate) fn next(&self, number: u64) -> Option<PixelRun> {
        match &self.frame.units {
            None => self.numbered(number),
            Some(source) => self.frame.begin_unit(&**source, &self.passes),
        }
    }

    /// The pixels with that number, once those before them in their tile are done.
    fn numbered(&self, number: u64) -> Option<PixelRun> {
        if self.frame.is_late() {
            return None;
        }
        let passes = &self.frame.passes;
        let run = passes.run(&self.passes, self.n_pixels, number)?;
        // With fewer tiles than threads the previous pass may still be under way: sums must be
        // made in order. Its thread never waits for this one.
        while !passes.is_turn_of(run.passes.start, run.tile) {
            if self.frame.is_over() || self.frame.is_late() {
                return None;
            }
            std::thread::yield_now();
        }
        Some(run)
    }

    /// Notes that pixels have been sampled.
    pub(crate) fn finish(&self, sampled: Sampled) {
        self.frame.finish(sampled);
    }
}

impl Frame {
    /// Notes that pixels have been sampled, all of a unit if others hand those out.
    pub(crate) fn finish(&self, sampled: Sampled) {
        let PixelRun { passes, .. } = &sampled.run;
        let n_samples = u64::from(sampled.n_pixels) * self.passes.samples(passes).len() as u64;
        self.pixels_sampled.fetch_add(n_samples, Ordering::Relaxed);
        let n_passes = passes.len() as u32;
        self.note_done(&sampled.run, sampled.n_pixels * n_passes);
        if let Some(source) = &self.units {
            self.end_unit(&**source, sampled);
        } else {
            let mut outcome = self.lock_outcome();
            outcome.counts.add(sampled.counts);
            outcome
                .faults
                .merge(sampled.faults.map(|faults| *faults).unwrap_or_default());
        }
    }
}

/// Single pixels as roots. One type, as every job that a program is run with is compiled with it.
pub(crate) enum PixelRoots<'f> {
    OfPass(PassesJob<'f>),
    OfUnits(UnitPixels<'f>),
}

impl<P: Program<Work = PixelRun, Output = Sampled>> Job<P> for PixelRoots<'_> {
    fn root(&self, number: u64) -> Option<PixelRun> {
        match self {
            Self::OfPass(job) => job.next(number),
            Self::OfUnits(job) => job.next(),
        }
    }

    fn has_root(&self) -> bool {
        match self {
            Self::OfPass(_) => true,
            Self::OfUnits(job) => job.has_next(),
        }
    }

    fn done(&self, _number: u64, sampled: Sampled) {
        match self {
            Self::OfPass(job) => job.finish(sampled),
            Self::OfUnits(job) => job.end_pixel(sampled),
        }
    }

    fn is_cancelled(&self) -> bool {
        match self {
            Self::OfPass(PassesJob { frame, .. }) => frame.is_cancelled(),
            Self::OfUnits(job) => job.is_cancelled(),
        }
    }
}

impl<P: Program<Work = PixelRun, Output = Sampled>> Job<P> for PassesJob<'_> {
    fn root(&self, number: u64) -> Option<PixelRun> {
        self.next(number)
    }

    fn done(&self, _number: u64, sampled: Sampled) {
        self.finish(sampled);
    }

    fn is_cancelled(&self) -> bool {
        self.frame.is_cancelled()
    }
}

/// Stops a frame whose code panicked.
pub(crate) struct StopOnPanic<'f>(pub(crate) &'f Frame);

impl Drop for StopOnPanic<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.has_panicked.store(true, Ordering::Relaxed);
        }
    }
}
