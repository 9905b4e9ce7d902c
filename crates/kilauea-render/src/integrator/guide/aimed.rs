//! Directions toward small bright lights as rough surfaces see them in mirrors, through glass and in
//! narrow highlights, where photons found them (after Jensen 1995, "Importance Driven Path Tracing
//! using the Photon Map").

use kilauea_bsdf::SeenBsdf;
use kilauea_gather::{AimField, Directions};

use super::guided::{Known, MIN_GUIDED_ROUGHNESS};
use super::{Drawn, Guide};
use crate::light::{ByImportance, ImportanceWalk, LightChooser, Receiver};

/// Knows directions in which something specular shows a light, as photons told.
#[derive(Clone, Copy)]
pub(crate) struct Aimed<'a> {
    pub(crate) field: &'a AimField,
}

/// The ratio of densities that an aimed path carries through specular surfaces.
#[derive(Clone, Copy)]
pub(crate) struct AimedTrail {
    density_ratio: f32,
}

/// Fraction of directions that are aimed, where there is something to aim at and all lobes are rough:
/// all that is left is worth so much more noise (decision 025).
const AIMED_SHARE: f32 = 0.25;
/// The same where no photon arrived near: enough for what arrives all the same not to be too bright.
const FAR_SHARE: f32 = 0.05;

impl Default for AimedTrail {
    fn default() -> Self {
        Self { density_ratio: 1.0 }
    }
}

impl<'a> Aimed<'a> {
    /// What there is to know of a place.
    #[inline]
    pub(super) fn know(directions: Directions<'a>) -> Known<'a> {
        let is_near = directions.near.is_some();
        let share = if is_near { AIMED_SHARE } else { FAR_SHARE };
        Known::new(Some(directions), share)
    }

    /// Whether some directions are aimed at surfaces of that kind, where photons arrive.
    pub(crate) fn aims_at(bsdf: &SeenBsdf) -> bool {
        bsdf.probability_of_rough(MIN_GUIDED_ROUGHNESS) > 0.0
    }
}

impl LightChooser for Aimed<'_> {
    type Walk = ImportanceWalk;

    #[inline(always)]
    fn walk(&self, receiver: Receiver) -> ImportanceWalk {
        ByImportance.walk(receiver)
    }
}

impl<'a> Guide for Aimed<'a> {
    type Knowledge = Known<'a>;
    type Trail = AimedTrail;

    #[inline]
    fn set_out(&self, trail: &mut AimedTrail) {
        *trail = AimedTrail::default();
    }

    #[inline]
    fn at(&self, receiver: Receiver) -> Known<'a> {
        Self::know(self.field.directions(receiver.p, receiver.n))
    }

    /// An aimed path has little weight, and may meet a bright light behind specular surfaces. Until
    /// it has left them it lives as one that the BSDF sent there by chance.
    #[inline]
    fn undimmed(trail: &mut AimedTrail, drawn: &Drawn) -> f32 {
        if drawn.sample.roughness >= MIN_GUIDED_ROUGHNESS {
            trail.density_ratio = drawn.density_ratio;
        }
        trail.density_ratio
    }
}
