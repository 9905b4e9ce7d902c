//! How a frame is shared out.

use std::ffi::OsString;
use std::net::IpAddr;
use std::path::PathBuf;
use std::time::Duration;

use kilauea_render::{Broadcast, Packing};
use serde::Deserialize;

use crate::crew::Crew;

/// What workers are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WorkerKind {
    /// Threads of this process, behind channels of bytes (tests).
    Threads,
    /// Processes on this machine, over loopback TCP. They get their ticket on standard input and
    /// then call [`crate::run_worker`].
    Processes {
        /// The program.
        program: PathBuf,
        /// What it is called with.
        arguments: Vec<OsString>,
    },
    /// Started by somebody else, on machines that reach this one at `host`: each ticket has to be
    /// taken ([`crate::ClusterJob::take_tickets`]) and brought to [`crate::run_worker_for`].
    Elsewhere {
        /// Address of this machine.
        host: IpAddr,
    },
}

/// How a frame is shared out.
#[derive(Clone, Debug)]
pub struct ClusterOptions {
    /// Workers at a time.
    pub n_workers: u32,
    /// What they are.
    pub kind: WorkerKind,
    /// How often workers may be started again, in all.
    pub max_restarts: u32,
    /// Time that a worker has for a unit before others may have it too.
    pub patience: Duration,
    /// A worker that says nothing for so long gets no more units until it does.
    pub suspect_after: Duration,
    /// A worker that says nothing for so long is dead. It says something every 250 ms.
    pub dead_after: Duration,
    /// Where results are kept until the frame is done; nowhere if absent.
    pub journal: Option<PathBuf>,
    /// Workers of earlier frames, of which some may have the scene, and where those of this one stay.
    pub crew: Option<Crew>,
    /// Whether links use TLS, with certificates made for this frame.
    pub tls: bool,
    /// Whether rays skip the code for what the scene does not have.
    pub specialize_rays: bool,
    /// How the scene is spread over workers; none where each has all of it.
    pub set: Option<SetOptions>,
}

/// How a scene is spread over sets of workers, each of which has a part of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub struct SetOptions {
    /// Workers of a set.
    pub size: SetSize,
    /// Which members are asked what a ray meets.
    pub broadcast: Broadcast,
    /// How rays and hits are packed.
    pub packing: Packing,
}

/// How many workers a set has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SetSize {
    /// So many.
    Workers(u32),
    /// As few as can hold the scene and its trees where each has room for so many bytes of them.
    /// Where one can, each has the whole scene.
    Memory(u64),
}

impl ClusterOptions {
    /// So many workers, each of which may be started again three times.
    pub fn new(n_workers: u32, kind: WorkerKind) -> Self {
        Self {
            n_workers,
            tls: matches!(kind, WorkerKind::Elsewhere { .. }),
            kind,
            max_restarts: n_workers.saturating_mul(3),
            patience: Duration::from_mins(1),
            suspect_after: Duration::from_secs(1),
            dead_after: Duration::from_secs(2),
            journal: None,
            crew: None,
            specialize_rays: true,
            set: None,
        }
    }
}
