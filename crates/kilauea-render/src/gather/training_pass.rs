//! One pass of training paths, spread evenly over the picture.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use kilauea_gather::{GatherRecord, PictureSample};
use kilauea_math::hash::combine;
use kilauea_scene::DataWindow;
use kilauea_spot::{Context, Job, Pool, Program, Runtime};

use crate::frame::Frame;
use crate::integrator::{
    Answer, Guide, Media, PathTrail, Question, RayTally, Training, Unmerged, n_rays,
};
use crate::program::StopOnPanic;
use crate::sampler::SamplerTables;
use crate::samples::{PixelSampler, SampleStart, SampledPixel};

/// Apart from all seeds of pictures.
const TRAINING_SEED: u32 = 0x7472_6169;
/// Columns and rows of blocks that a root takes.
const BLOCKS_PER_ROOT: u32 = 64;

/// Blocks of pixels of which one pixel each is looked at.
pub(super) struct TrainingGrid {
    min: [i32; 2],
    max: [i32; 2],
    /// Pixels on the side of a block.
    stride: i32,
    n_columns: u32,
    n_blocks: u32,
    samples_per_block: u32,
    seed: u32,
    sampler: SamplerTables,
}

impl TrainingGrid {
    /// A grid for about `n_paths` paths.
    pub(super) fn new(frame: &Frame, pass: u32, n_paths: f64) -> Self {
        let DataWindow { min, max } = frame.film.data_window();
        // Two paths a pixel at least, which tell how much they differ.
        let pixels_per_pair = frame.n_pixels as f64 / (0.5 * n_paths).max(1.0);
        let stride = pixels_per_pair.sqrt().ceil().max(1.0) as i32;
        let n_columns = ((max[0] - min[0]) as u32).div_ceil(stride as u32);
        let n_rows = ((max[1] - min[1]) as u32).div_ceil(stride as u32);
        let n_blocks = n_columns * n_rows;
        let samples_per_block = 2 * (0.5 * n_paths / f64::from(n_blocks)).round().max(1.0) as u32;
        let seed = combine(frame.settings.seed, TRAINING_SEED.wrapping_add(pass));
        Self {
            min,
            max,
            stride,
            n_columns,
            n_blocks,
            samples_per_block,
            seed,
            sampler: SamplerTables::new(samples_per_block, frame.settings.max_depth, seed),
        }
    }

    /// A pixel of a block, by chance.
    fn pixel(&self, block: u32) -> SampledPixel<'_> {
        let corner = [block % self.n_columns, block / self.n_columns];
        let position = std::array::from_fn(|axis| {
            let offset = combine(combine(self.seed, block), axis as u32) % self.stride as u32;
            let pixel = self.min[axis] + corner[axis] as i32 * self.stride + offset as i32;
            pixel.min(self.max[axis] - 1)
        });
        SampledPixel {
            position,
            sequence: self.sampler.pixel(position),
        }
    }
}

/// The program of a training pass: a SPOT traces the paths of some blocks, one after the other.
pub(super) struct TrainingProgram<'f, const CUTOUTS: bool, M> {
    pub(super) sampler: PixelSampler<'f, CUTOUTS, M, Training<'f>, Unmerged>,
    pub(super) grid: &'f TrainingGrid,
}

/// What a SPOT found.
#[derive(Default)]
pub(super) struct Trained {
    records: Vec<GatherRecord>,
    samples: Vec<PictureSample>,
    counts: RayTally,
}

impl<const CUTOUTS: bool, M: Media> Program for TrainingProgram<'_, CUTOUTS, M> {
    type Work = Range<u32>;
    type Output = Trained;
    type Question = Question;
    type Answer = Answer;

    fn starter<'a, R: Runtime<'a, Self>>(
        &'a self,
        runtime: &R,
    ) -> impl Fn(Range<u32>, R::Context) -> R::Started {
        let blocks = runtime.pool("training paths");
        move |run, cx| blocks.start(self.trace_blocks(run, cx))
    }
}

impl<const CUTOUTS: bool, M: Media> TrainingProgram<'_, CUTOUTS, M> {
    async fn trace_blocks<C: Context<Self>>(&self, blocks: Range<u32>, cx: C) -> Trained {
        let PixelSampler { frame, integrator } = &self.sampler;
        let _stop = StopOnPanic(frame);
        let mut trained = Trained::default();
        let mut trail = PathTrail::default();
        let mut n_rays_before = 0;
        for block in blocks {
            if frame.is_over() || frame.is_late() {
                break;
            }
            let pixel = self.grid.pixel(block);
            integrator.guide.begin(&mut trail, pixel.position);
            for sample_idx in 0..self.grid.samples_per_block {
                let SampleStart { ray, sampler, .. } = self.sampler.start(&pixel, sample_idx);
                let counts = &mut trained.counts;
                let path = integrator.start(ray);
                let out = integrator
                    .trace(path, sampler, counts, &mut trail, &cx)
                    .await;
                trail.end(&out, counts, &mut trained.records);
                let n_rays = n_rays(counts);
                trained.samples.push(PictureSample {
                    pixel: pixel.position,
                    luminance: out.light().luminance(),
                    n_rays: (n_rays - std::mem::replace(&mut n_rays_before, n_rays)) as f32,
                });
            }
        }
        trained
    }
}

/// All blocks of a grid, in roots of so many.
pub(super) struct TrainingJob<'f> {
    frame: &'f Frame,
    n_blocks: u32,
    /// By the number of the root.
    found: Mutex<Vec<Trained>>,
}

impl<'f> TrainingJob<'f> {
    pub(super) fn new(frame: &'f Frame, grid: &TrainingGrid) -> Self {
        let n_roots = grid.n_blocks.div_ceil(BLOCKS_PER_ROOT) as usize;
        Self {
            frame,
            n_blocks: grid.n_blocks,
            found: Mutex::new((0..n_roots).map(|_| Trained::default()).collect()),
        }
    }

    /// What all paths found, in the order of the picture.
    pub(super) fn into_found(self) -> (Vec<GatherRecord>, Vec<PictureSample>) {
        let found = self.found.into_inner();
        let mut all = (Vec::new(), Vec::new());
        for trained in found.unwrap_or_else(PoisonError::into_inner) {
            all.0.extend(trained.records);
            all.1.extend(trained.samples);
        }
        all
    }
}

impl<P: Program<Work = Range<u32>, Output = Trained>> Job<P> for TrainingJob<'_> {
    fn root(&self, number: u64) -> Option<Range<u32>> {
        let first = u32::try_from(number).ok()?.checked_mul(BLOCKS_PER_ROOT)?;
        let last = (first + BLOCKS_PER_ROOT).min(self.n_blocks);
        (first < self.n_blocks && !self.frame.is_late()).then_some(first..last)
    }

    fn done(&self, number: u64, trained: Trained) {
        self.frame.lock_outcome().counts.add(trained.counts);
        let mut found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        found[number as usize] = trained;
    }

    fn is_cancelled(&self) -> bool {
        self.frame.is_cancelled()
    }
}
