//! What is told of workers and links.

use std::sync::atomic::Ordering;

use serde::{Deserialize, Serialize};

use crate::link::Traffic;

/// A worker in one of its lives.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct WorkerStats {
    /// Number of the worker.
    pub rank: u32,
    /// How often it was started before.
    pub incarnation: u32,
    /// Of the process; 0 for a thread.
    pub pid: u32,
    /// Engine threads.
    pub threads: u32,
    /// Whether it had the scene since an earlier frame, and was not sent it.
    pub kept_scene: bool,
    /// Units whose results counted.
    pub units: u64,
    /// Units that it rendered for nothing, as it was more than a pass behind others of its set, or the time
    /// was up.
    pub units_dropped: u64,
    /// Rays traced for those whose results counted.
    pub rays: u64,
    /// Seconds from when it could render to its last result.
    pub working_secs: f64,
    /// Highest resident size of the process, bytes.
    pub peak_rss: u64,
    /// Its place in a set; absent where each worker has the whole scene.
    pub seat: Option<SeatStats>,
    /// Why it was lost; absent where it was there to the end.
    pub lost: Option<String>,
}

impl WorkerStats {
    /// What is to be said of one that was behind others of its set, in a frame that is complete.
    pub(crate) fn why_behind(&self) -> Option<String> {
        let Self {
            rank,
            units_dropped: n,
            ..
        } = self;
        (*n > 0).then(|| {
            format!(
                "worker {rank} rendered {n} units for nothing: it was more than a pass behind other \
                 members of its set, which have the photons of two passes"
            )
        })
    }
}

/// A worker's place in a set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SeatStats {
    /// Number of the set.
    pub set: u32,
    /// Of the member in it.
    pub member: u32,
    /// What went over links with the other members, as it said in the end.
    pub links: NetworkStats,
}

/// What one process sent and got.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct NetworkStats {
    /// Bytes that went, headers included.
    pub bytes_sent: u64,
    /// Bytes that came.
    pub bytes_received: u64,
    /// Frames either way.
    pub messages: u64,
    /// Frames of workers that were dead already, which were dropped.
    pub stale_messages: u64,
}

impl From<&Traffic> for NetworkStats {
    fn from(traffic: &Traffic) -> Self {
        Self {
            bytes_sent: traffic.bytes_sent.load(Ordering::Relaxed),
            bytes_received: traffic.bytes_received.load(Ordering::Relaxed),
            messages: traffic.messages.load(Ordering::Relaxed),
            stale_messages: traffic.stale_messages.load(Ordering::Relaxed),
        }
    }
}
