use kilauea_bsdf::{BsdfSample, SeenBsdf};
use kilauea_math::{Spectrum, Vec3};

use super::{Guide, Knowledge, Roulette};
use crate::light::Receiver;

/// Knows nothing, at no cost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unguided;

impl Guide for Unguided {
    type Knowledge = Self;
    type Trail = ();

    #[inline(always)]
    fn at(&self, (): &(), _: Receiver) -> Self {
        Self
    }
}

impl Knowledge for Unguided {
    #[inline(always)]
    fn chooses_directions(&self) -> bool {
        false
    }

    #[inline(always)]
    fn sample(&self, bsdf: &SeenBsdf, u: [f32; 3]) -> Option<BsdfSample> {
        bsdf.sample(u)
    }

    #[inline(always)]
    fn pdf(&self, _: &SeenBsdf, _: Vec3, bsdf_pdf: f32) -> f32 {
        bsdf_pdf
    }

    #[inline(always)]
    fn roulette(
        &self,
        depth: u32,
        _: &SeenBsdf,
        _: Spectrum,
        throughput: Spectrum,
    ) -> Option<Roulette> {
        Roulette::by_throughput(depth, throughput)
    }
}
