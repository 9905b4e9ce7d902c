//! The program that the dataflow engine runs: what a SPOT of a frame does, and which there are.

use std::ops::Range;
use std::sync::MutexGuard;
use std::sync::atomic::Ordering;

use kilauea_film::Tile;
use kilauea_spot::{Context, Job, Pool, Program, Runtime};

use crate::frame::Frame;
use crate::integrator::{Answer, Guide, Media, Merge, Question, RayTally};
use crate::passes::PixelRun;
use crate::samples::{PixelSampler, SampleStart};

/// The program: a SPOT takes the samples of some pixels, one after the other.
///
/// A path has one ray to follow and one light to look at, so its vertices need no SPOTs of their
/// own: they would only hand on its throughput.
pub(crate) struct PixelProgram<'f, const CUTOUTS: bool, M, G, X> {
    pub(crate) sampler: PixelSampler<'f, CUTOUTS, M, G, X>,
}

/// What a SPOT did.
#[derive(Default)]
pub(crate) struct Sampled {
    pub(crate) n_pixels: u32,
    pub(crate) counts: RayTally,
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
    /// Takes the samples that some pixels get in a pass, and adds them to the film.
    ///
    /// Not an `async fn`, which would keep each argument in two places while it waits; and nothing has
    /// a name that is found as easily by way of `self`.
    fn sample_pixels<C: Context<Self>>(
        &self,
        mut run: PixelRun,
        cx: C,
    ) -> impl Future<Output = Sampled> {
        let mut sampled = Sampled::default();
        let mut trail = G::Trail::default();
        async move {
            // Others may wait for these pixels.
            let _stop = StopOnPanic(self.sampler.frame);
            // Code that waits must not keep others from the tile.
            let mut held_tile = (!C::WAITS).then(|| self.tile(run.tile));
            #[allow(clippy::while_let_on_iterator, reason = "a `for` keeps a reference")]
            while let Some(pixel_idx) = run.pixels.next() {
                if self.sampler.frame.is_over() {
                    break;
                }
                let pixel = self.sampler.pixel(run.tile, pixel_idx);
                let guide = &self.sampler.integrator.guide;
                guide.begin(&mut trail, pixel.position);
                for sample_idx in self.sampler.frame.passes.samples(run.pass) {
                    let SampleStart { ray, sampler, view } = self.sampler.start(&pixel, sample_idx);
                    let is_finite = {
                        let path = self.sampler.integrator.start(ray);
                        let counts = &mut sampled.counts;
                        let found = (self.sampler.integrator)
                            .trace(path, sampler, counts, &mut trail, &cx)
                            .await;
                        let sample = self.sampler.finish(&view, &found);
                        let pixel_idx = pixel_idx as usize;
                        match &mut held_tile {
                            Some(tile) => tile.add(pixel_idx, &sample),
                            None => self.tile(run.tile).add(pixel_idx, &sample),
                        }
                    };
                    if !is_finite {
                        // In a box, as room for it would be in the state of every path.
                        Box::pin(self.sampler.note_fault(&pixel, sample_idx, &cx)).await;
                    }
                }
                sampled.n_pixels += 1;
            }
            sampled
        }
    }

    fn tile(&self, tile: u32) -> MutexGuard<'_, Tile> {
        self.sampler.frame.film.tile(tile as usize)
    }
}

impl PassesJob<'_> {
    fn run(&self, number: u64) -> Option<PixelRun> {
        self.frame.passes.run(&self.passes, self.n_pixels, number)
    }

    /// The pixels to sample next, once those before them in their tile are done. `None` where
    /// there are no more, or no time.
    pub(crate) fn next(&self, number: u64) -> Option<PixelRun> {
        if self.frame.is_late() {
            return None;
        }
        let run = self.run(number)?;
        // With fewer tiles than threads the previous pass may still be under way: sums must be
        // made in order. Its thread never waits for this one.
        while !self.frame.passes.is_turn_of(run.pass, run.tile) {
            if self.frame.is_over() || self.frame.is_late() {
                return None;
            }
            std::thread::yield_now();
        }
        Some(run)
    }

    /// Notes that the pixels with that number have been sampled.
    pub(crate) fn finish(&self, number: u64, sampled: &Sampled) {
        let Some(run) = self.run(number) else { return };
        let frame = self.frame;
        frame.lock_outcome().counts.add(sampled.counts);
        let n_samples = u64::from(sampled.n_pixels) * frame.passes.samples(run.pass).len() as u64;
        frame.pixels_sampled.fetch_add(n_samples, Ordering::Relaxed);
        frame.passes.note_done(run.tile, sampled.n_pixels);
    }
}

impl<P: Program<Work = PixelRun, Output = Sampled>> Job<P> for PassesJob<'_> {
    fn root(&self, number: u64) -> Option<PixelRun> {
        self.next(number)
    }

    fn done(&self, number: u64, sampled: Sampled) {
        self.finish(number, &sampled);
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
