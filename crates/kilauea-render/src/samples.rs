//! A sample of a pixel: which ray it follows, and what becomes of the light that comes back.

use kilauea_accel::Ray;
use kilauea_film::PixelSample;
use kilauea_math::Vec2;
use kilauea_spot::{Context, Program};

use crate::frame::Frame;
use crate::integrator::{
    Answer, Fault, FirstFault, Guide, Media, Merge, PathIntegrator, PathSample, Question, RayTally,
    SampleId, Step,
};
use crate::sampler::{PixelSequence, Purpose, Sampler};

/// Takes samples of pixels.
pub(crate) struct PixelSampler<'f, const CUTOUTS: bool, M, G, X> {
    pub(crate) frame: &'f Frame,
    pub(crate) integrator: PathIntegrator<'f, CUTOUTS, M, G, X>,
}

/// A pixel of which samples are taken.
#[derive(Clone, Copy)]
pub(crate) struct SampledPixel<'f> {
    /// Column and row.
    pub(crate) position: [i32; 2],
    pub(crate) sequence: PixelSequence<'f>,
}

/// A sample that begins.
pub(crate) struct SampleStart<'f> {
    pub(crate) ray: Ray,
    pub(crate) sampler: Sampler<'f>,
    pub(crate) view: SampleView,
}

/// What is needed of the beginning of a sample at its end.
pub(crate) struct SampleView {
    /// Distance along the ray per unit of depth along the view axis.
    distance_per_depth: f32,
    /// Squared distance from the center of the pixel.
    offset_sq: f32,
}

impl<const CUTOUTS: bool, M: Media, G: Guide, X: Merge> PixelSampler<'_, CUTOUTS, M, G, X> {
    /// The pixel with that number in a tile.
    pub(crate) fn pixel(&self, tile: u32, pixel_idx: u32) -> SampledPixel<'_> {
        let position = self.frame.passes.pixel(tile, pixel_idx);
        SampledPixel {
            position,
            sequence: self.frame.sampler.pixel(position),
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
        let [x, y] = pixel.position;
        let center = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
        let camera_ray = frame.camera.ray(center + offset, lens, time);
        SampleStart {
            ray: camera_ray.ray,
            sampler,
            view: SampleView {
                distance_per_depth: camera_ray.distance_per_depth,
                offset_sq: offset.length_squared(),
            },
        }
    }

    /// What the film gets of what the integrator found.
    #[inline]
    pub(crate) fn finish(&self, view: &SampleView, found: &PathSample) -> PixelSample {
        let mut sample = found.at_pixel(view.distance_per_depth, view.offset_sq);
        let exposure = self.frame.prepared.camera.exposure_scale;
        if exposure != 1.0 {
            sample.expose(exposure);
        }
        sample
    }

    /// Follows a sample again whose light was not finite, to see where that began. Its rays are not
    /// counted.
    #[cold]
    pub(crate) async fn find_fault<P, C>(
        &self,
        pixel: &SampledPixel<'_>,
        sample_idx: u32,
        cx: &C,
    ) -> (SampleId, Fault)
    where
        P: Program<Question = Question, Answer = Answer>,
        C: Context<P>,
    {
        let first = FirstFault::default();
        let mut counts = RayTally::default();
        let integrator = self.integrator.watched_by(&first);
        let mut trail = G::Trail::default();
        integrator.guide.begin(&mut trail, pixel.position);
        let SampleStart { ray, sampler, .. } = self.start(pixel, sample_idx);
        let path = integrator.start(ray);
        integrator
            .trace(path, sampler, &mut counts, &mut trail, cx)
            .await;
        let fault = first.get().unwrap_or(Fault {
            step: Step::Exposure,
            depth: 0,
            at: None,
        });
        let id = SampleId {
            row: pixel.position[1],
            column: pixel.position[0],
            sample: sample_idx,
        };
        (id, fault)
    }
}
