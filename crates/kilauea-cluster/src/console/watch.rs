//! What others may see of a console.

use std::time::Duration;

use kilauea_render::peak_rss_bytes;

use super::Console;
use super::peer::{Peer, Stage};
use crate::snapshot::{Snapshot, WorkerState, WorkerView};
use crate::stats::NetworkStats;

impl Console {
    pub(super) fn snapshot(&self) -> Snapshot {
        let now = self.now();
        let mut workers: Vec<WorkerView> = (self.peers.values())
            .map(|peer| peer.view(now, self.options.suspect_after))
            .collect();
        workers.sort_by_key(|worker| worker.stats.rank);
        Snapshot {
            fraction_done: self.frame.progress(),
            n_passes_over: self.ledger.n_passes_over(),
            n_passes: self.ledger.n_passes(),
            units: self.ledger.counts(),
            network: NetworkStats::from(&*self.gate.traffic),
            workers,
            lost: self.lost.clone(),
            n_started: self.n_started,
            peak_rss: peak_rss_bytes(),
        }
    }
}

impl Peer {
    fn view(&self, now: Duration, suspect_after: Duration) -> WorkerView {
        let silence = now.saturating_sub(self.last_heard);
        let (state, outbox) = match &self.stage {
            Stage::Starting => (WorkerState::Starting, None),
            Stage::Preparing(outbox) => (WorkerState::Preparing, Some(outbox)),
            Stage::Working(outbox) if silence < suspect_after => {
                (WorkerState::Working, Some(outbox))
            }
            Stage::Working(outbox) => (WorkerState::Suspect, Some(outbox)),
            Stage::Finished => (WorkerState::Finished, None),
        };
        let waiting = outbox.map_or(0, |outbox| outbox.max_capacity() - outbox.capacity());
        WorkerView {
            epoch: self.holder.epoch,
            state,
            silence_secs: silence.as_secs_f64(),
            n_held: self.n_leases,
            n_frames_waiting: waiting as u64,
            stats: self.stats.clone(),
        }
    }
}
