use kilauea_bsdf::SeenBsdf;
use kilauea_math::Vec3;

use super::{Drawn, Guide, Knowledge};
use crate::light::{ByImportance, ImportanceWalk, LightChooser, Receiver};

/// Knows nothing, at no cost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unguided;

impl LightChooser for Unguided {
    type Walk = ImportanceWalk;

    #[inline(always)]
    fn walk(&self, receiver: Receiver) -> ImportanceWalk {
        ByImportance.walk(receiver)
    }
}

impl Guide for Unguided {
    type Knowledge = Self;
    type Trail = ();

    #[inline(always)]
    fn at(&self, _: Receiver) -> Self {
        Self
    }
}

impl Knowledge for Unguided {
    #[inline(always)]
    fn chooses_directions(&self) -> bool {
        false
    }

    #[inline(always)]
    fn sample(&self, bsdf: &SeenBsdf, u: [f32; 3]) -> Option<Drawn> {
        bsdf.sample(u).map(Drawn::by_bsdf)
    }

    #[inline(always)]
    fn pdf(&self, _: &SeenBsdf, _: Vec3, bsdf_pdf: f32) -> f32 {
        bsdf_pdf
    }
}
