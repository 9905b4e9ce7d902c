//! Rendering: prepares a scene, traces paths on engine threads, and returns a film.
//!
//! [`PreparedScene`] holds all that is computed once; [`RenderJob`] is one frame of it. Where several
//! processes render a frame, each is a [`RenderJob`] that takes [`Unit`]s from a [`UnitSource`], and a
//! [`CollectedFrame`] puts their results together.

#![forbid(unsafe_code)]

mod aim;
mod camera;
mod caustics;
mod check;
mod collect;
mod conditions;
mod error;
mod final_gather;
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
mod report;
mod sampler;
mod samples;
mod set;
mod shades;
mod share;
#[cfg(test)]
mod statistics;
mod stats;
mod strategy;
mod unit_pixels;
mod units;
mod wire;

pub use caustics::{PhotonDemand, may_have_photons_by_pass};
pub use collect::CollectedFrame;
pub use conditions::Conditions;
pub use error::RenderError;
pub use gather::{EstimateLayer, EstimateReport, GatherEstimate, estimate_picture};
pub use geometry::View;
pub use job::{RenderJob, RenderResult};
pub use needs::SceneNeeds;
pub use photon::{
    Importon, ImportonRequest, LightShares, MIN_ROUGHNESS, PhotonBenefit, PhotonCounts,
    PhotonMemory, PhotonNumbers, PhotonPart, PhotonRays, PhotonReport, PhotonRequest, PhotonTimes,
    TracedPhotons, photon_benefit, photon_picture, trace_importons, trace_photons,
};
pub use prepared::{PrepareOptions, PreparedScene};
#[doc(hidden)]
pub use set::fuzzing;
pub use set::{
    Answered, Broadcast, MemberBytes, MemberSeat, MemberStats, Packing, Partners, PartnersGone,
    PhotonRoom, PlacementError, RaySample, RayTraffic, Set, SetOutline, SetPlan, SetStats,
};
pub use share::{PathKind, PathPass, PathShare};
pub use stats::{
    AimStats, CausticStats, GatherStats, Rays, RenderStats, SceneSize, peak_rss_bytes,
};
pub use units::{
    Availability, Tally, TileResult, TileStart, Unit, UnitError, UnitOrder, UnitSource,
};
