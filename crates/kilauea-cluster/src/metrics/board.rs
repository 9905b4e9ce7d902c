//! What is shown: the frame that is rendered, and sums over those before it.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::job::Status;
use crate::snapshot::Snapshot;
use crate::stats::WorkerStats;

/// Frames of a command.
#[derive(Debug, Default)]
pub(super) struct Board {
    /// The last frame that was begun.
    current: Option<Arc<Status>>,
    past: Totals,
    n_frames: u64,
}

/// Numbers that only grow.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Totals {
    pub(super) n_lent: u64,
    pub(super) n_lent_again: u64,
    pub(super) n_done: u64,
    pub(super) n_late_results: u64,
    pub(super) bytes_sent: u64,
    pub(super) bytes_received: u64,
    pub(super) messages: u64,
    pub(super) stale_messages: u64,
    pub(super) n_started: u64,
    pub(super) n_lost: u64,
    /// Units and rays, by worker, in all its lives.
    pub(super) by_rank: BTreeMap<u32, [u64; 2]>,
}

/// All that a page is made of.
#[derive(Debug, Default)]
pub(super) struct View {
    pub(super) now: Snapshot,
    pub(super) totals: Totals,
    pub(super) n_frames: u64,
}

impl Board {
    /// From now on another frame is rendered.
    pub(super) fn begin(&mut self, frame: Arc<Status>) {
        if let Some(last) = self.current.replace(frame) {
            self.past.add(&Totals::of(&last.snapshot()));
        }
        self.n_frames += 1;
    }

    pub(super) fn view(&self) -> View {
        let now = self.current.as_ref().map(|frame| frame.snapshot());
        let now = now.unwrap_or_default();
        let mut totals = self.past.clone();
        totals.add(&Totals::of(&now));
        View {
            now,
            totals,
            n_frames: self.n_frames,
        }
    }
}

impl Totals {
    fn of(frame: &Snapshot) -> Self {
        let mut by_rank = BTreeMap::<u32, [u64; 2]>::new();
        let here = frame.workers.iter().map(|worker| &worker.stats);
        for WorkerStats {
            rank, units, rays, ..
        } in here.chain(&frame.lost)
        {
            add_to(by_rank.entry(*rank).or_default(), [*units, *rays]);
        }
        Self {
            n_lent: frame.units.n_lent,
            n_lent_again: frame.units.n_lent_again,
            n_done: frame.units.n_done,
            n_late_results: frame.units.n_late_results,
            bytes_sent: frame.network.bytes_sent,
            bytes_received: frame.network.bytes_received,
            messages: frame.network.messages,
            stale_messages: frame.network.stale_messages,
            n_started: frame.n_started.into(),
            n_lost: frame.lost.len() as u64,
            by_rank,
        }
    }

    fn add(&mut self, other: &Self) {
        self.n_lent += other.n_lent;
        self.n_lent_again += other.n_lent_again;
        self.n_done += other.n_done;
        self.n_late_results += other.n_late_results;
        self.bytes_sent += other.bytes_sent;
        self.bytes_received += other.bytes_received;
        self.messages += other.messages;
        self.stale_messages += other.stale_messages;
        self.n_started += other.n_started;
        self.n_lost += other.n_lost;
        for (&rank, &counts) in &other.by_rank {
            add_to(self.by_rank.entry(rank).or_default(), counts);
        }
    }
}

fn add_to(sums: &mut [u64; 2], counts: [u64; 2]) {
    for (sum, count) in sums.iter_mut().zip(counts) {
        *sum += count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::snapshot::{UnitCounts, WorkerState, WorkerView};

    fn frame(n_done: u64, lives: &[(u32, u64)]) -> Arc<Status> {
        let stats = |&(rank, units): &(u32, u64)| WorkerStats {
            rank,
            units,
            rays: 10 * units,
            ..WorkerStats::default()
        };
        let status = Arc::new(Status::default());
        status.show(Snapshot {
            units: UnitCounts {
                n_done,
                ..UnitCounts::default()
            },
            workers: vec![WorkerView {
                epoch: 9,
                state: WorkerState::Working,
                silence_secs: 0.0,
                n_held: 0,
                n_frames_waiting: 0,
                stats: stats(&lives[0]),
            }],
            lost: lives[1..].iter().map(stats).collect(),
            n_started: lives.len() as u32,
            ..Snapshot::default()
        });
        status
    }

    #[test]
    fn totals_go_on_from_frame_to_frame() {
        let mut board = Board::default();
        assert_eq!(board.view().totals, Totals::default());
        board.begin(frame(3, &[(0, 1), (1, 2)]));
        board.begin(frame(4, &[(1, 1), (1, 3)]));
        let View {
            now,
            totals,
            n_frames,
        } = board.view();
        assert_eq!((now.units.n_done, totals.n_done, n_frames), (4, 7, 2));
        assert_eq!((totals.n_started, totals.n_lost), (4, 2));
        let by_rank: Vec<_> = totals.by_rank.into_iter().collect();
        assert_eq!(by_rank, [(0, [1, 10]), (1, [6, 60])]);
    }
}
