//! Caustics by photons: whether they pay, how many, and the map that each pass of samples merges
//! with, or what the camera sees of them.

mod demand;
mod division;
mod pass;
mod plan;
mod radius;
mod splat_pass;
mod splats;

pub use demand::{PhotonDemand, may_have_photons_by_pass};
pub(crate) use pass::CausticSource;
pub(crate) use plan::CausticPlan;
pub(crate) use splats::{Splat, Splats};
