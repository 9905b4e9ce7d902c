//! A cluster on paper: how fast sets of machines trace rays that they ask each other about.
//!
//! Layers, each checked against the one before:
//!
//! - [`law`]: closed forms for a set in which nothing ever waits in vain;
//! - [`SetModel`]: the machines of one set as a discrete-event simulation, with batches, processors,
//!   network cards and latency. Rays come from a [`RayTrace`] of a real render, so that who is asked
//!   is what the scene makes it;
//! - [`ReplicaModel`]: workers that hold the whole scene, which has been held against real frames
//!   (`crates/kilauea-cluster/examples/replicas.rs`);
//! - [`FarmModel`]: sets that take tiles of a frame first come, first served, while machines fail.
//!
//! Sets do not talk to each other, so one set is enough to know how fast all are, and a thousand
//! machines take no longer to simulate than ten.

#![forbid(unsafe_code)]

mod events;
mod farm;
pub mod law;
mod machine;
mod random;
mod replicas;
mod set;
mod trace;

pub use farm::{FarmModel, FrameOutcome};
pub use machine::{Batching, Machine, RaySizes};
pub use replicas::{ReplicaLink, ReplicaModel, ReplicaOutcome, UnitCost};
pub use set::{SetModel, SetOutcome};
pub use trace::{RayTrace, TraceError, TracedRay};
