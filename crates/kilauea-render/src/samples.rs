//! One sample of a pixel, from its place in the pixel to its radiance.

use kilauea_film::PixelSample;
use kilauea_math::Vec2;
use kilauea_spot::{Context, Program};

use crate::frame::Frame;
use crate::integrator::{Answer, PathIntegrator, Question, RayCounts};
use crate::sampler::{PixelSequence, Purpose};

/// Takes samples of pixels.
pub(crate) struct PixelSampler<'f, const CUTOUTS: bool> {
    pub(crate) frame: &'f Frame,
    pub(crate) integrator: PathIntegrator<'f, CUTOUTS>,
}

/// A pixel of which samples are taken.
#[derive(Clone, Copy)]
pub(crate) struct SampledPixel<'f> {
    sequence: PixelSequence<'f>,
    /// In pixels.
    center: Vec2,
}

impl<const CUTOUTS: bool> PixelSampler<'_, CUTOUTS> {
    /// The pixel with that number in a tile.
    pub(crate) fn pixel(&self, tile: u32, pixel_idx: u32) -> SampledPixel<'_> {
        let [x, y] = self.frame.passes.pixel(tile, pixel_idx);
        SampledPixel {
            sequence: self.frame.sampler.pixel([x, y]),
            center: Vec2::new(x as f32 + 0.5, y as f32 + 0.5),
        }
    }

    /// Takes one sample of a pixel. What its rays meet is asked of `cx`.
    #[inline]
    pub(crate) async fn sample<P, C>(
        &self,
        pixel: SampledPixel<'_>,
        sample_idx: u32,
        counts: &mut RayCounts,
        cx: &C,
    ) -> PixelSample
    where
        P: Program<Question = Question, Answer = Answer>,
        C: Context<P>,
    {
        let frame = self.frame;
        let sampler = pixel.sequence.sampler(sample_idx);
        let offset = frame.filter.sample(sampler.pair(Purpose::Filter));
        let lens = if frame.needs.lens {
            sampler.pair(Purpose::Lens)
        } else {
            Vec2::splat(0.5)
        };
        let time = if frame.needs.motion {
            sampler.pair(Purpose::Time).x
        } else {
            0.0
        };
        let ray = frame.camera.ray(pixel.center + offset, lens, time);
        let mut sample = self
            .integrator
            .trace(&ray, &frame.camera, &sampler, counts, cx)
            .await;
        sample.offset_sq = offset.length_squared();
        let exposure = frame.prepared.scene.camera.exposure_scale;
        if exposure != 1.0 {
            sample.expose(exposure);
        }
        sample
    }
}
