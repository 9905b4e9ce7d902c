//! A frame rendered by several processes, with the pixels that one would give.
//!
//! A [`ClusterJob`] is the console: it cuts the frame into units, lends them to workers, and puts
//! their results together. Workers ([`run_worker`]) hold the whole scene, or a part of it in a set
//! whose members ask each other what rays meet, and render units. What a unit
//! comes to depends on nothing but the scene, the settings and the tile's sums before, so that it may
//! be done by anyone and more than once: a worker that dies costs time and changes no bit.

#![forbid(unsafe_code)]

mod console;
mod crew;
mod error;
mod estimates;
#[doc(hidden)]
pub mod fuzzing;
mod handshake;
mod job;
mod journal;
mod ledger;
pub mod link;
mod metrics;
mod options;
mod plan;
pub mod protocol;
mod scene;
mod snapshot;
mod stats;
mod ticket;
mod tls;
mod worker;

pub use console::ClusterResult;
pub use crew::Crew;
pub use error::ClusterError;
pub use estimates::{
    EstimatesError, EstimatesOf, load_estimates, load_estimates_of, save_estimates,
};
pub use handshake::{HandshakeError, build_hash};
pub use job::ClusterJob;
pub use journal::{Journal, JournalError};
pub use metrics::MetricsServer;
pub use options::{ClusterOptions, SetOptions, SetSize, WorkerKind};
pub use scene::{SceneBytesError, scene_from_bytes, scene_to_bytes};
pub use snapshot::{Snapshot, UnitCounts, WorkerState, WorkerView};
pub use stats::{NetworkStats, SeatStats, WorkerStats};
pub use ticket::{Ticket, Token};
pub use tls::Identity;
pub use worker::{Worker, WorkerError, run_worker, run_worker_for};
