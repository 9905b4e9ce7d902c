//! Caustics by photons: whether they pay, how many, and the map that each pass of samples merges
//! with.

mod pass;
mod plan;
mod radius;
mod stats;

pub(crate) use plan::CausticPlan;
pub use stats::CausticStats;
