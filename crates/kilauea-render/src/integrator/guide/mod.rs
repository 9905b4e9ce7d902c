//! What paths know beforehand of the light that they look for, and what they leave for others.

mod aimed;
mod guided;
mod light_guided;
mod training;
mod unguided;

use kilauea_bsdf::{BsdfSample, SeenBsdf};
use kilauea_math::{Spectrum, Vec3};

use super::path_sample::PathSample;
use crate::light::{LightChooser, Lights, Receiver};

pub(crate) use aimed::Aimed;
pub(crate) use guided::{GUIDED_SHARE, Guided, MIN_GUIDED_ROUGHNESS};
pub(crate) use light_guided::LightGuided;
pub(crate) use training::{Notes, PathTrail, Training, n_rays};
pub(crate) use unguided::Unguided;

/// What paths know, lights among it.
pub(crate) trait Guide: LightChooser {
    /// Whether rays are aimed at what mirrors show. Not where all that a vertex adds is told to be of
    /// the light that it chose.
    const AIMS_BY_MIRRORS: bool = true;

    /// What they know of one vertex.
    type Knowledge: Knowledge;
    /// What a path leaves of itself.
    type Trail: Default;

    /// What is known of a place that a path reaches.
    fn at(&self, receiver: Receiver) -> Self::Knowledge;

    /// Paths begin in a pixel.
    #[inline]
    fn begin(&self, _trail: &mut Self::Trail, _pixel: [i32; 2]) {}

    /// A path leaves the camera, after others with the same trail.
    #[inline]
    fn set_out(&self, _trail: &mut Self::Trail) {}

    /// A light was chosen at a vertex, by number, before it adds anything to the sample.
    #[inline]
    fn seek(
        _trail: &mut Self::Trail,
        _lights: &Lights,
        _receiver: Receiver,
        _light: u32,
        _out: &PathSample,
    ) {
    }

    /// A path goes on from a vertex by `sample`, or ends there. `arriving` is the share of its light
    /// that came as far.
    #[inline]
    fn leave(
        _trail: &mut Self::Trail,
        _receiver: Receiver,
        _sample: Option<&BsdfSample>,
        _arriving: Spectrum,
    ) {
    }

    /// The factor by which the path would be brighter, had the BSDF alone chosen its last directions.
    /// What it brings is no dimmer than that says: it is for roulette.
    #[inline]
    fn undimmed(_trail: &mut Self::Trail, _drawn: &Drawn) -> f32 {
        1.0
    }

    /// All that the vertex itself adds to the sample has been added.
    #[inline]
    fn depart(_trail: &mut Self::Trail, _out: &PathSample) {}
}

/// A direction that a vertex has drawn.
#[derive(Clone, Copy)]
pub(crate) struct Drawn {
    pub(crate) sample: BsdfSample,
    /// Its density over that of the BSDF alone.
    pub(crate) density_ratio: f32,
}

impl Drawn {
    /// By the BSDF alone.
    #[inline(always)]
    pub(crate) fn by_bsdf(sample: BsdfSample) -> Self {
        Self {
            sample,
            density_ratio: 1.0,
        }
    }
}

/// What is known of the light at a vertex.
pub(crate) trait Knowledge: Copy {
    /// Whether directions may be drawn from what is known.
    fn chooses_directions(&self) -> bool;

    /// Draws a direction; `u` is as for [`SeenBsdf::sample`].
    fn sample(&self, bsdf: &SeenBsdf, u: [f32; 3]) -> Option<Drawn>;

    /// Density with which [`Self::sample`] finds `wi`, which the BSDF alone finds with `bsdf_pdf`.
    fn pdf(&self, bsdf: &SeenBsdf, wi: Vec3, bsdf_pdf: f32) -> f32;
}
