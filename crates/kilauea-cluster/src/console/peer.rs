//! A worker as the console sees it.

use std::time::Duration;

use tokio::sync::mpsc;

use super::launch::WorkerProcess;
use crate::ledger::Holder;
use crate::protocol::Frame;
use crate::stats::WorkerStats;

/// Time for a worker's process to start and to join.
const JOIN: Duration = Duration::from_mins(1);

/// A worker in one of its lives.
pub(super) struct Peer {
    pub(super) holder: Holder,
    pub(super) stage: Stage,
    pub(super) last_heard: Duration,
    /// When it could render.
    pub(super) ready_at: Duration,
    /// Where it answers others of its set.
    pub(super) address: Option<String>,
    /// Units that it holds.
    pub(super) n_leases: u32,
    /// Passes that it knows to be over.
    pub(super) n_passes_over: u32,
    pub(super) stats: WorkerStats,
    /// Ends with the peer.
    pub(super) process: Option<WorkerProcess>,
}

/// How far a worker is.
#[derive(Clone, Debug)]
pub(super) enum Stage {
    /// It was started.
    Starting,
    /// It has joined and prepares the scene.
    Preparing(mpsc::Sender<Frame>),
    /// It renders units.
    Working(mpsc::Sender<Frame>),
    /// It has said all.
    Finished,
}

impl Peer {
    /// Sends a frame; false where the worker takes none.
    pub(super) fn send(&self, frame: Frame) -> bool {
        match &self.stage {
            Stage::Starting | Stage::Finished => false,
            Stage::Preparing(outbox) | Stage::Working(outbox) => outbox.try_send(frame).is_ok(),
        }
    }

    /// Whether it may get another unit: one for each thread, and one that waits for the first thread
    /// to be free. In a set one more, as pixels wait for what other members are asked.
    pub(super) fn is_free(&self, now: Duration, suspect_after: Duration) -> bool {
        matches!(self.stage, Stage::Working(_))
            && self.n_leases < self.n_leases_at_once()
            && now.saturating_sub(self.last_heard) < suspect_after
    }

    fn n_leases_at_once(&self) -> u32 {
        let n_ahead = if self.address.is_some() { 2 } else { 1 };
        self.stats.threads.saturating_add(n_ahead)
    }

    /// Why it is lost, if it is. One that has joined and says nothing is dead after a time.
    pub(super) fn why_lost(&mut self, now: Duration, dead_after: Duration) -> Option<String> {
        let silence = now.saturating_sub(self.last_heard);
        match self.stage {
            Stage::Finished => None,
            Stage::Starting => {
                let ended = self.process.as_mut().and_then(WorkerProcess::ended);
                let late = || "it did not join".to_owned();
                ended.or_else(|| (silence > JOIN).then(late))
            }
            Stage::Preparing(_) | Stage::Working(_) => {
                let secs = silence.as_secs_f64();
                (silence > dead_after).then(|| format!("it said nothing for {secs:.1} s"))
            }
        }
    }
}
