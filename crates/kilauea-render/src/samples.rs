//! A sample of a pixel: which ray it follows, and what becomes of the light that comes back.

use kilauea_accel::Ray;
use kilauea_film::PixelSample;
use kilauea_math::Vec2;
use kilauea_spot::{Context, Program};

use crate::frame::Frame;
use crate::integrator::{
    Answer, Fault, FirstFault, Guide, Media, Merge, PathIntegrator, Question, RayCounts, SampleId,
    Step,
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

/// What is known of a sample besides its ray.
pub(crate) struct SampleStart<'f> {
    pub(crate) sampler: Sampler<'f>,
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

    /// Begins a sample: its ray, and the rest.
    #[inline]
    pub(crate) fn start<'s>(
        &self,
        pixel: &SampledPixel<'s>,
        sample_idx: u32,
    ) -> (Ray, SampleStart<'s>) {
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
        let start = SampleStart {
            sampler,
            distance_per_depth: camera_ray.distance_per_depth,
            offset_sq: offset.length_squared(),
        };
        (camera_ray.ray, start)
    }

    /// Completes what the integrator found.
    #[inline]
    pub(crate) fn finish(&self, start: &SampleStart<'_>, sample: &mut PixelSample) {
        sample.offset_sq = start.offset_sq;
        if sample.z < f32::INFINITY {
            sample.z /= start.distance_per_depth;
        }
        let exposure = self.frame.prepared.scene.camera.exposure_scale;
        if exposure != 1.0 {
            sample.expose(exposure);
        }
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
        let mut counts = RayCounts::default();
        let integrator = self.integrator.watched_by(&first);
        let mut trail = G::Trail::default();
        integrator.guide.begin(&mut trail, pixel.position);
        let (ray, start) = self.start(pixel, sample_idx);
        let path = integrator.start(ray);
        integrator
            .trace(path, &start.sampler, &mut counts, &mut trail, cx)
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
