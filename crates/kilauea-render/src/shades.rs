//! What shades did that waited for answers.

use std::time::Duration;

use kilauea_spot::Stats;

use crate::stats::ShadeStats;

/// Counters over all runs of a frame.
#[derive(Default)]
pub(crate) struct Shades {
    peak_bytes: usize,
    at_peak: ShadeStats,
    n_questions: u64,
    /// All engine threads together, before the last pixel of each run had begun.
    in_use: Duration,
    starved: Duration,
}

impl Shades {
    /// Adds a run.
    pub(crate) fn add(&mut self, stats: &Stats) {
        if stats.peak_bytes() > self.peak_bytes {
            self.peak_bytes = stats.peak_bytes();
            self.at_peak = ShadeStats {
                in_flight_peak: stats.peak_spots() as u64,
                questions_at_peak: stats.sum(|t| t.questions_at_peak as u64),
                ..ShadeStats::default()
            };
        }
        self.n_questions += stats.sum(|t| t.n_questions);
        for thread in &stats.threads {
            self.in_use += thread.total.saturating_sub(thread.waited_for_end);
            self.starved += thread.starved;
        }
    }

    /// Bound on the bytes in flight at once.
    pub(crate) fn peak_bytes(&self) -> u64 {
        self.peak_bytes as u64
    }

    pub(crate) fn stats(&self) -> ShadeStats {
        let in_use = self.in_use.as_secs_f64();
        ShadeStats {
            questions: self.n_questions,
            busy: if in_use > 0.0 {
                1.0 - self.starved.as_secs_f64() / in_use
            } else {
                0.0
            },
            ..self.at_peak
        }
    }
}
