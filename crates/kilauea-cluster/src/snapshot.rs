//! A frame in the making, as of one moment.

use serde::Serialize;

use crate::stats::{NetworkStats, WorkerStats};

/// Of the mean speed of workers: who is slower holds the others up.
const SLOW_SHARE: f64 = 0.5;

/// What the console knows of a frame; made four times a second.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Snapshot {
    /// Fraction of the samples that are here.
    pub fraction_done: f64,
    /// Passes that all tiles are through.
    pub n_passes_over: u32,
    /// Passes of the frame.
    pub n_passes: u32,
    /// What became of units.
    pub units: UnitCounts,
    /// What went over links.
    pub network: NetworkStats,
    /// Workers that are there, by rank.
    pub workers: Vec<WorkerView>,
    /// Lives of workers that are over.
    pub lost: Vec<WorkerStats>,
    /// Workers started, again included.
    pub n_started: u32,
    /// Highest resident size of the console, bytes.
    pub peak_rss: u64,
}

/// What became of units so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct UnitCounts {
    /// Units of the frame.
    pub n_units: u64,
    /// Units that have a result.
    pub n_done: u64,
    /// Units that somebody holds; twice where two do.
    pub n_held: u64,
    /// Times that a unit was lent.
    pub n_lent: u64,
    /// Of those, times that it had been lent before.
    pub n_lent_again: u64,
    /// Results that came too late to count.
    pub n_late_results: u64,
}

/// How far a worker is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum WorkerState {
    /// It was started.
    Starting,
    /// It has joined and prepares the scene.
    Preparing,
    /// It renders units.
    Working,
    /// It renders units, and has said nothing for a while.
    Suspect,
    /// It has said all.
    Finished,
}

impl WorkerState {
    /// Every state.
    pub const ALL: [Self; 5] = [
        Self::Starting,
        Self::Preparing,
        Self::Working,
        Self::Suspect,
        Self::Finished,
    ];

    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Starting => "starting",
            Self::Preparing => "preparing",
            Self::Working => "working",
            Self::Suspect => "suspect",
            Self::Finished => "finished",
        }
    }
}

/// A worker that is there.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorkerView {
    /// The life that it is in.
    pub epoch: u32,
    /// How far it is.
    pub state: WorkerState,
    /// Seconds since it last said anything.
    pub silence_secs: f64,
    /// Units that it holds.
    pub n_held: u32,
    /// Frames that wait to be sent to it.
    pub n_frames_waiting: u64,
    /// What it did in this life.
    #[serde(flatten)]
    pub stats: WorkerStats,
}

impl Snapshot {
    /// Workers that hold the frame up, by rank: suspects, and those that work at less than half the mean
    /// speed of all who work, by rays in a second.
    pub fn laggards(&self) -> Vec<u32> {
        let speed = |worker: &WorkerView| worker.stats.rays as f64 / worker.stats.working_secs;
        let working = || {
            let at_work = |w: &&WorkerView| w.state == WorkerState::Working && w.stats.units > 0;
            self.workers.iter().filter(at_work)
        };
        let n_working = working().count();
        let mean = working().map(speed).sum::<f64>() / n_working.max(1) as f64;
        let is_slow = |worker: &WorkerView| speed(worker) < SLOW_SHARE * mean;
        let suspects = (self.workers.iter()).filter(|w| w.state == WorkerState::Suspect);
        let mut ranks: Vec<u32> = suspects
            .chain(working().filter(|worker| is_slow(worker)))
            .map(|worker| worker.stats.rank)
            .collect();
        ranks.sort_unstable();
        ranks
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn worker(rank: u32, state: WorkerState, rays: u64) -> WorkerView {
        WorkerView {
            epoch: rank + 1,
            state,
            silence_secs: 0.0,
            n_held: 1,
            n_frames_waiting: 0,
            stats: WorkerStats {
                rank,
                units: u64::from(rays > 0),
                rays,
                working_secs: 2.0,
                ..WorkerStats::default()
            },
        }
    }

    #[test]
    fn the_slow_and_the_silent_are_named() {
        let mut snapshot = Snapshot {
            workers: vec![
                worker(0, WorkerState::Working, 1000),
                worker(1, WorkerState::Working, 1100),
                worker(2, WorkerState::Working, 300),
                worker(3, WorkerState::Suspect, 1000),
                // Nobody knows yet how fast it is.
                worker(4, WorkerState::Working, 0),
                worker(5, WorkerState::Preparing, 0),
            ],
            ..Snapshot::default()
        };
        assert_eq!(snapshot.laggards(), [2, 3]);
        snapshot.workers.truncate(1);
        assert!(snapshot.laggards().is_empty());
        assert!(Snapshot::default().laggards().is_empty());
    }
}
