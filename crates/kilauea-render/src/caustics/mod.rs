//! Caustics by photons: whether they pay, how many, and the map that each pass of samples merges
//! with.

mod demand;
mod division;
mod pass;
mod plan;
mod radius;

pub use demand::PhotonDemand;
pub(crate) use pass::CausticSource;
pub(crate) use plan::CausticPlan;
