//! One pass of training paths, spread evenly over the picture.

use kilauea_gather::{ChoiceRecords, GatherRecord, PictureSample};
use kilauea_math::hash::combine;
use kilauea_scene::DataWindow;
use kilauea_spot::{Context, Program};

use crate::follow::Follow;
use crate::frame::Frame;
use crate::integrator::{
    Answer, Guide, Media, PathTrail, Question, RayTally, Training, Unmerged, n_rays,
};
use crate::program::StopOnPanic;
use crate::sampler::SamplerTables;
use crate::samples::{PixelSampler, SampleStart, SampledPixel};

/// Apart from all seeds of pictures.
const TRAINING_SEED: u32 = 0x7472_6169;

/// Blocks of pixels of which one pixel each is looked at.
pub(super) struct TrainingGrid {
    min: [i32; 2],
    max: [i32; 2],
    /// Pixels on the side of a block.
    stride: i32,
    n_columns: u32,
    pub(super) n_blocks: u32,
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

/// Follows the paths of a block, one after the other.
pub(super) struct TrainingPaths<'f, const CUTOUTS: bool, M> {
    pub(super) sampler: PixelSampler<'f, CUTOUTS, M, Training<'f>, Unmerged>,
    pub(super) grid: &'f TrainingGrid,
}

/// What paths of some blocks found.
#[derive(Default)]
pub(super) struct Trained {
    pub(super) records: Vec<GatherRecord>,
    pub(super) choices: ChoiceRecords,
    pub(super) samples: Vec<PictureSample>,
    pub(super) counts: RayTally,
}

impl<const CUTOUTS: bool, M: Media> Follow for TrainingPaths<'_, CUTOUTS, M> {
    type Left = Trained;

    async fn follow<P, C>(&self, block: u32, trained: &mut Trained, cx: &C)
    where
        P: Program<Question = Question, Answer = Answer>,
        C: Context<P>,
    {
        let PixelSampler { frame, integrator } = &self.sampler;
        let _stop = StopOnPanic(frame);
        if frame.is_over() || frame.is_late() {
            return;
        }
        let pixel = self.grid.pixel(block);
        let mut trail = PathTrail::default();
        integrator.guide.begin(&mut trail, pixel.position);
        for sample_idx in 0..self.grid.samples_per_block {
            let SampleStart { ray, sampler, .. } = self.sampler.start(&pixel, sample_idx);
            let n_rays_before = n_rays(&trained.counts);
            let out = integrator
                .trace(
                    integrator.start(ray),
                    sampler,
                    &mut trained.counts,
                    &mut trail,
                    cx,
                )
                .await;
            trail.end(&out, &mut trained.records);
            trained.samples.push(PictureSample {
                pixel: pixel.position,
                luminance: out.light().luminance(),
                n_rays: (n_rays(&trained.counts) - n_rays_before) as f32,
            });
        }
        trained.choices.append(&trail.choices);
    }
}
