//! Rendering: prepares a scene, traces paths on engine threads, and returns a film.
//!
//! [`PreparedScene`] holds all that is computed once; [`RenderJob`] is one frame of it.

#![forbid(unsafe_code)]

mod camera;
mod caustics;
mod check;
mod conditions;
mod error;
mod follow;
mod frame;
mod gather;
mod geometry;
mod integrator;
mod job;
mod light;
mod needs;
mod noise;
mod passes;
mod photon;
mod plain;
mod prepared;
mod program;
mod sampler;
mod samples;
mod shades;
#[cfg(test)]
mod statistics;
mod stats;

pub use conditions::Conditions;
pub use error::RenderError;
pub use geometry::View;
pub use job::{RenderJob, RenderResult};
pub use needs::SceneNeeds;
pub use photon::{
    Importon, ImportonRequest, LightShares, MIN_ROUGHNESS, PhotonBenefit, PhotonCounts,
    PhotonMemory, PhotonNumbers, PhotonRays, PhotonReport, PhotonRequest, PhotonTimes,
    TracedPhotons, photon_benefit, photon_picture, trace_importons, trace_photons,
};
pub use prepared::{PrepareOptions, PreparedScene};
pub use stats::{CausticStats, GatherStats, RenderStats, peak_rss_bytes};
