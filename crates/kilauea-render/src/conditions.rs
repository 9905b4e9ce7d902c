//! What experiments change about how a frame is computed, and never about its image.

use serde::Deserialize;

use crate::set::{Broadcast, Packing};

/// Conditions of an experiment. The default is how every frame is rendered; the rest is for
/// measurements and tests and changes no bit of the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Conditions {
    /// Take the samples in a plain loop, without the dataflow engine: what that costs is measured
    /// against it. [`RenderSettings::shading`](kilauea_scene::RenderSettings::shading) is ignored.
    pub plain_loop: bool,
    /// Start pixels in the order of the picture, first come, first served, whatever those before
    /// them wait for. Where shades wait, memory grows with the picture.
    pub first_come: bool,
    /// Hold each answer back for a random time up to this many milliseconds, so that answers
    /// arrive late and in any order; 0, or what is no time, is not at all. Only where shades wait.
    pub answer_delay_ms: f64,
    /// Who is asked what a ray meets, where the scene is spread over a set.
    pub broadcast: Broadcast,
    /// How questions to members of a set are packed, where they travel as bytes.
    pub packing: Packing,
    /// Note what one ray in so many of those asked of a set may meet; 0 is none.
    pub sample_one_in: u32,
}
