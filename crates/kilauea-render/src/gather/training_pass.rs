//! One pass of training paths, spread evenly over the picture.

use kilauea_gather::{ChoiceRecords, GatherRecord, PictureSample};
use kilauea_math::hash::combine;
use kilauea_spot::{Context, Program};

use super::pixel_grid::PixelGrid;
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

/// Pixels of which some samples each are looked at.
pub(super) struct TrainingGrid {
    pub(super) pixels: PixelGrid,
    samples_per_block: u32,
    sampler: SamplerTables,
}

impl TrainingGrid {
    /// A grid for about `n_paths` paths.
    pub(super) fn new(frame: &Frame, pass: u32, n_paths: f64) -> Self {
        let seed = combine(frame.settings.seed, TRAINING_SEED.wrapping_add(pass));
        // Two paths a pixel at least, which tell how much they differ.
        let pixels = PixelGrid::new(frame, 0.5 * n_paths, seed);
        let n_pairs = 0.5 * n_paths / f64::from(pixels.n_blocks);
        let samples_per_block = 2 * n_pairs.round().max(1.0) as u32;
        Self {
            pixels,
            samples_per_block,
            sampler: SamplerTables::new(samples_per_block, frame.settings.max_depth, seed),
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
        let position = self.grid.pixels.pixel(block);
        let pixel = SampledPixel {
            position,
            sequence: self.grid.sampler.pixel(position),
        };
        let mut trail = PathTrail::default();
        integrator.guide.begin(&mut trail, position);
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
                pixel: position,
                luminance: out.light().luminance(),
                n_rays: (n_rays(&trained.counts) - n_rays_before) as f32,
            });
        }
        trained.choices.append(&trail.choices);
    }
}
