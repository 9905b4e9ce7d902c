//! A sample of a pixel: which ray it follows, and what becomes of the light that comes back.

use kilauea_film::PixelSample;
use kilauea_math::Vec2;

use crate::camera::CameraRay;
use crate::frame::Frame;
use crate::integrator::PathIntegrator;
use crate::sampler::{PixelSequence, Purpose, Sampler};

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

/// Where a sample begins.
pub(crate) struct SampleStart<'f> {
    pub(crate) ray: CameraRay,
    pub(crate) sampler: Sampler<'f>,
    /// Squared distance from the center of the pixel.
    offset_sq: f32,
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

    /// Begins a sample.
    #[inline]
    pub(crate) fn start<'s>(&self, pixel: &SampledPixel<'s>, sample_idx: u32) -> SampleStart<'s> {
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
        SampleStart {
            ray: frame.camera.ray(pixel.center + offset, lens, time),
            sampler,
            offset_sq: offset.length_squared(),
        }
    }

    /// Completes what the integrator found.
    #[inline]
    pub(crate) fn finish(&self, start: &SampleStart<'_>, sample: &mut PixelSample) {
        sample.offset_sq = start.offset_sq;
        let exposure = self.frame.prepared.scene.camera.exposure_scale;
        if exposure != 1.0 {
            sample.expose(exposure);
        }
    }
}
