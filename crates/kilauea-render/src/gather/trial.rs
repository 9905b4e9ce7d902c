//! A trial: all samples of a few pixels, with what was learnt and without, twice each.
//!
//! Samples of a pixel have stratified numbers. What they share out evenly by those, no knowledge
//! makes better, and no path by itself tells how much that is.

use kilauea_gather::{PathError, PictureEstimate, PictureSample};
use kilauea_math::hash::combine;
use kilauea_spot::{Context, Program, RunError};

use super::pixel_grid::PixelGrid;
use crate::follow::Follow;
use crate::frame::Frame;
use crate::integrator::{
    Answer, Guide, Media, Merge, PathTrail, Question, RayTally, RayTracer, Training, Unmerged,
    n_rays,
};
use crate::program::StopOnPanic;
use crate::sampler::SamplerTables;
use crate::samples::{PixelSampler, SampleStart, SampledPixel};
use crate::share::PathKind;

/// Share of a frame's paths in a trial.
const TRIAL_SHARE: f64 = 1.0 / 64.0;
/// More tell nothing new.
const MOST_PIXELS: f64 = 2048.0;
/// Samples of a pixel at most: those of a longer frame share out little more.
const MOST_SAMPLES: u32 = 64;
/// Of each pixel, two with and two without.
const N_PICTURES: f64 = 4.0;
/// Apart from all seeds of pictures and of training.
const TRIAL_SEED: u32 = 0x7472_6961;

/// The pixels of a trial, and the numbers of either sample of each.
pub(crate) struct TrialGrid {
    pixels: PixelGrid,
    pub(crate) n_samples: u32,
    numbers: [SamplerTables; 2],
}

impl TrialGrid {
    /// `seed` tells trials of a frame apart.
    pub(crate) fn new(frame: &Frame, seed: u32) -> Self {
        let settings = &frame.settings;
        let n_samples = settings.samples_per_pixel.min(MOST_SAMPLES);
        let seed = combine(settings.seed, TRIAL_SEED.wrapping_add(seed));
        let n_pixels = TRIAL_SHARE * frame.n_pixels as f64 / N_PICTURES;
        Self {
            pixels: PixelGrid::new(frame, n_pixels.min(MOST_PIXELS), seed),
            n_samples,
            numbers: [1, 2].map(|picture| {
                SamplerTables::new(n_samples, settings.max_depth, combine(seed, picture))
            }),
        }
    }
}

/// Takes the samples of a pixel, with and without.
pub(crate) struct TrialPaths<'f, const CUTOUTS: bool, M, X = Unmerged> {
    pub(crate) plain: PixelSampler<'f, CUTOUTS, M, Training<'f>, Unmerged>,
    pub(crate) told: PixelSampler<'f, CUTOUTS, M, Training<'f>, X>,
    pub(crate) grid: &'f TrialGrid,
}

/// Means of all samples of pixels, two after each other of one pixel.
#[derive(Default)]
pub(crate) struct Tried {
    pub(crate) plain: Vec<PictureSample>,
    pub(crate) told: Vec<PictureSample>,
    pub(crate) counts: RayTally,
}

impl Tried {
    /// Errors of pixels without and with what was learnt. None where no pixel was tried.
    pub(crate) fn errors(&self, picture: &PictureEstimate) -> Option<[PathError; 2]> {
        let plain = picture.error_of(&self.plain)?;
        Some([plain, picture.error_of(&self.told)?])
    }
}

impl<const CUTOUTS: bool, M: Media, X: Merge> TrialPaths<'_, CUTOUTS, M, X> {
    /// Takes those of all pixels, together with those who render the same frame.
    pub(crate) fn run(&self, tracer: &RayTracer<'_, CUTOUTS>) -> Result<Tried, RunError> {
        let frame = self.plain.frame;
        let followed = self
            .grid
            .pixels
            .follow(self, PathKind::Trial, frame, tracer)?;
        let mut all = Tried::default();
        for tried in followed {
            frame.lock_outcome().counts.add(tried.counts);
            all.plain.extend(tried.plain);
            all.told.extend(tried.told);
        }
        Ok(all)
    }
}

impl<const CUTOUTS: bool, M: Media, X: Merge> Follow for TrialPaths<'_, CUTOUTS, M, X> {
    type Left = Tried;

    async fn follow<P, C>(&self, block: u32, tried: &mut Tried, cx: &C)
    where
        P: Program<Question = Question, Answer = Answer>,
        C: Context<P>,
    {
        let frame = self.plain.frame;
        let _stop = StopOnPanic(frame);
        if frame.is_over() || frame.is_late() {
            return;
        }
        let Tried {
            plain,
            told,
            counts,
        } = tried;
        let position = self.grid.pixels.pixel(block);
        for numbers in &self.grid.numbers {
            let pixel = SampledPixel {
                position,
                sequence: numbers.pixel(position),
            };
            plain.push(self.grid.mean(&self.plain, &pixel, counts, cx).await);
            told.push(self.grid.mean(&self.told, &pixel, counts, cx).await);
        }
    }
}

impl TrialGrid {
    /// The mean of all samples of a pixel.
    async fn mean<const CUTOUTS: bool, M: Media, X: Merge, P, C>(
        &self,
        sampler: &PixelSampler<'_, CUTOUTS, M, Training<'_>, X>,
        pixel: &SampledPixel<'_>,
        counts: &mut RayTally,
        cx: &C,
    ) -> PictureSample
    where
        P: Program<Question = Question, Answer = Answer>,
        C: Context<P>,
    {
        let integrator = &sampler.integrator;
        let mut trail = PathTrail::default();
        integrator.guide.begin(&mut trail, pixel.position);
        let n_rays_before = n_rays(counts);
        let mut sum = 0.0;
        for sample_idx in 0..self.n_samples {
            let SampleStart { ray, sampler, .. } = sampler.start(pixel, sample_idx);
            let path = integrator.start(ray);
            let out = integrator
                .trace(path, sampler, counts, &mut trail, cx)
                .await;
            sum += out.light().luminance();
        }
        let n_samples = self.n_samples as f32;
        PictureSample {
            pixel: pixel.position,
            luminance: sum / n_samples,
            n_rays: (n_rays(counts) - n_rays_before) as f32 / n_samples,
        }
    }
}
