//! What a run did.

use std::time::Duration;

/// Counters of a run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Stats {
    /// By engine thread.
    pub threads: Vec<ThreadStats>,
    /// From the first thread's start to the last one's end.
    pub wall: Duration,
}

/// Counters of one engine thread.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ThreadStats {
    /// SPOTs started; 0 where questions are answered inline, as nothing is counted there.
    pub n_spots: u64,
    /// Roots done.
    pub n_roots: u64,
    /// Questions asked; 0 where they are answered inline.
    pub n_questions: u64,
    /// Children taken from other threads.
    pub n_stolen: u64,
    /// Times that a SPOT was resumed.
    pub n_resumed: u64,
    /// Cells allocated for futures: the most that were in use at once, however many SPOTs there
    /// were.
    pub n_cells: usize,
    /// Most bytes in flight: futures, slots, questions under way and children not yet started.
    pub peak_bytes: usize,
    /// Most SPOTs in flight.
    pub peak_spots: usize,
    /// Questions asked and not read when most bytes were in flight.
    pub questions_at_peak: usize,
    /// From start to end.
    pub total: Duration,
    /// Waited while there were roots left to admit.
    pub starved: Duration,
    /// Of that, while the budget had no room for another root.
    pub starved_of_memory: Duration,
    /// Waited for the last roots to end.
    pub waited_for_end: Duration,
}

impl Stats {
    /// Bound on the bytes that were in flight at once: the sum of each thread's own peak.
    pub fn peak_bytes(&self) -> usize {
        self.threads.iter().map(|t| t.peak_bytes).sum()
    }

    /// Bound on the SPOTs that were in flight at once.
    pub fn peak_spots(&self) -> usize {
        self.threads.iter().map(|t| t.peak_spots).sum()
    }

    /// Sum of a counter over all threads.
    pub fn sum(&self, counter: impl Fn(&ThreadStats) -> u64) -> u64 {
        self.threads.iter().map(counter).sum()
    }
}

impl ThreadStats {
    /// Fraction of the time in which the thread had something to do, up to the admission of the
    /// last root.
    pub fn busy_fraction(&self) -> f64 {
        1.0 - fraction(self.starved, self.until_last_root())
    }

    /// The same without the time in which the budget had no room for another root: what is missing
    /// to 1 is what the engine could do better.
    pub fn busy_fraction_with_memory(&self) -> f64 {
        let starved = self.starved.saturating_sub(self.starved_of_memory);
        let time = self.until_last_root();
        1.0 - fraction(starved, time.saturating_sub(self.starved_of_memory))
    }

    fn until_last_root(&self) -> Duration {
        self.total.saturating_sub(self.waited_for_end)
    }
}

fn fraction(part: Duration, whole: Duration) -> f64 {
    if whole.is_zero() {
        0.0
    } else {
        part.as_secs_f64() / whole.as_secs_f64()
    }
}
