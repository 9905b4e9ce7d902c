//! A frame without the dataflow engine: what that costs is measured against this loop, and its
//! images are held to this loop's.

use std::convert::Infallible;
use std::future::{Pending, Ready, ready};
use std::pin::pin;
use std::sync::atomic::{AtomicU64, Ordering};
use std::task::{self, Poll, Waker};
use std::thread::scope;

use kilauea_spot::{Answerer, Context, Program, RunError, Runtime};

use crate::integrator::{Answer, Guide, Media, Merge, Question, RayTracer};
use crate::passes::PixelRun;
use crate::program::{PassesJob, Sampled, StopOnPanic};
use crate::samples::{PixelSampler, SampleStart};

/// A program without SPOTs: there is no work to start one from.
struct NoSpots;

/// What code sees whose questions are answered within the call, and that spawns nothing.
struct Answered<'a, const CUTOUTS: bool>(&'a RayTracer<'a, CUTOUTS>);

/// Takes all samples of `job`, whose roots are whole tiles, on `n_threads` threads.
pub(crate) fn run_plain<const CUTOUTS: bool, M: Media, G: Guide, X: Merge>(
    sampler: &PixelSampler<'_, CUTOUTS, M, G, X>,
    tracer: &RayTracer<'_, CUTOUTS>,
    job: &PassesJob<'_>,
    n_threads: usize,
) -> Result<(), RunError> {
    let next_number = AtomicU64::new(0);
    let run = || {
        loop {
            let number = next_number.fetch_add(1, Ordering::Relaxed);
            let Some(run) = job.next(number) else { break };
            job.finish(sample_tile(sampler, tracer, run));
        }
    };
    scope(|threads| {
        let handles: Vec<_> = (0..n_threads).map(|_| threads.spawn(run)).collect();
        let results: Vec<_> = handles
            .into_iter()
            .map(std::thread::ScopedJoinHandle::join)
            .collect();
        results.into_iter().collect::<Result<(), _>>()
    })
    .map_err(|_| RunError::ThreadPanicked {
        thread: "the plain loop".into(),
        message: "its message is on stderr".into(),
    })
}

/// Takes the samples that a tile's pixels get.
fn sample_tile<const CUTOUTS: bool, M: Media, G: Guide, X: Merge>(
    sampler: &PixelSampler<'_, CUTOUTS, M, G, X>,
    tracer: &RayTracer<'_, CUTOUTS>,
    run: PixelRun,
) -> Sampled {
    let PixelSampler { frame, integrator } = sampler;
    let _stop = StopOnPanic(frame);
    let mut sampled = Sampled::new(run);
    let mut trail = G::Trail::default();
    let tile_idx = sampled.run.tile;
    let mut tile = frame.film.tile(tile_idx as usize);
    for pixel_idx in sampled.run.pixels.by_ref() {
        if frame.is_over() {
            break;
        }
        sampled.n_pixels += 1;
        if frame.is_settled(tile_idx, pixel_idx) {
            continue;
        }
        let pixel = sampler.pixel(tile_idx, pixel_idx);
        integrator.guide.begin(&mut trail, pixel.position);
        for sample_idx in frame.passes.samples(&sampled.run.passes) {
            let start = sampler.start(&pixel, sample_idx);
            let SampleStart {
                ray,
                sampler: numbers,
                view,
            } = start;
            let cx = Answered(tracer);
            let path = integrator.start(ray);
            let counts = &mut sampled.counts;
            let path = integrator.trace(path, numbers, counts, &mut trail, &cx);
            let mut found = in_place(path);
            integrator
                .merge
                .show(pixel.position, sample_idx, &mut found);
            let sample = sampler.finish(&view, &found);
            if !tile.add(pixel_idx as usize, &sample) {
                let (id, fault) = in_place(sampler.find_fault(&pixel, sample_idx, &cx));
                sampled.faults.get_or_insert_default().add(id, fault);
            }
        }
    }
    sampled
}

/// The output of a future that never waits.
#[inline]
fn in_place<T>(future: impl Future<Output = T>) -> T {
    match pin!(future).poll(&mut task::Context::from_waker(Waker::noop())) {
        Poll::Ready(output) => output,
        Poll::Pending => unreachable!("every question is answered within the call"),
    }
}

impl Program for NoSpots {
    type Work = Infallible;
    type Output = Infallible;
    type Question = Question;
    type Answer = Answer;

    fn starter<'a, R: Runtime<'a, Self>>(
        &'a self,
        _: &R,
    ) -> impl Fn(Infallible, R::Context) -> R::Started {
        |work, _| match work {}
    }
}

impl<const CUTOUTS: bool> Clone for Answered<'_, CUTOUTS> {
    fn clone(&self) -> Self {
        Self(self.0)
    }
}

impl<const CUTOUTS: bool> Context<NoSpots> for Answered<'_, CUTOUTS> {
    const WAITS: bool = false;

    type Reply = Ready<Answer>;
    type Child = Pending<Infallible>;

    #[inline]
    fn ask(&self, question: Question) -> Ready<Answer> {
        ready(Answerer::<NoSpots>::answer(self.0, question))
    }

    fn spawn(&self, work: Infallible) -> Pending<Infallible> {
        match work {}
    }
}
