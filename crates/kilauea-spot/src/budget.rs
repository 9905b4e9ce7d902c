//! How much memory SPOTs in flight may take.

/// Least number of roots that a thread admits before it has seen what they lead to.
const MIN_FIRST_WINDOW: usize = 64;
/// What each root is taken to lead to until then. More than most, and little of a budget.
const FIRST_ROOT_BYTES: usize = 64 << 10;

/// The bytes that one engine thread has in flight, and its share of the budget.
pub(crate) struct Budget {
    share_bytes: usize,
    bytes: usize,
    peak_bytes: usize,
    n_spots: usize,
    peak_spots: usize,
    n_questions: usize,
    questions_at_peak: usize,
    n_roots: usize,
    window: usize,
}

/// What a thread may still do. Each level is allowed less than the one before, so that what was
/// begun finds memory to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Pressure {
    /// Anything. Up to half of the share: roots leave as much to what they lead to.
    Admit,
    /// Start children. Up to three quarters.
    Start,
    /// Resume SPOTs, whose questions and children take less than their end sets free. Up to seven
    /// eighths.
    Resume,
    /// Nothing but the work of privileged roots.
    Full,
}

impl Budget {
    pub(crate) fn new(share_bytes: usize) -> Self {
        Self {
            share_bytes,
            bytes: 0,
            peak_bytes: 0,
            n_spots: 0,
            peak_spots: 0,
            n_questions: 0,
            questions_at_peak: 0,
            n_roots: 0,
            window: (share_bytes / FIRST_ROOT_BYTES).max(MIN_FIRST_WINDOW),
        }
    }

    pub(crate) fn peak_bytes(&self) -> usize {
        self.peak_bytes
    }

    pub(crate) fn peak_spots(&self) -> usize {
        self.peak_spots
    }

    /// Questions that were asked and not read when most bytes were in flight.
    pub(crate) fn questions_at_peak(&self) -> usize {
        self.questions_at_peak
    }

    /// Whether the whole share is not used yet; what [`Order::FirstCome`](crate::Order) asks for.
    pub(crate) fn is_within_share(&self) -> bool {
        self.bytes == 0 || self.bytes < self.share_bytes
    }

    /// Whether there is room for a root, and for what roots lead to by all that was seen.
    ///
    /// Roots that are in flight together grow together while answers are slow: by the time that
    /// memory is short it is full of beginnings. So the number of roots is limited as that of
    /// packets is on a network (Jacobson 1988): it grows with every root that ends, and is halved
    /// when memory gets short.
    pub(crate) fn may_admit(&self) -> bool {
        self.pressure() == Pressure::Admit && self.n_roots < self.window
    }

    /// A root was admitted.
    pub(crate) fn begin_root(&mut self) {
        self.n_roots += 1;
    }

    /// A root and all it led to have ended.
    pub(crate) fn end_root(&mut self) {
        // Not while roots are fewer for other reasons, or still too many.
        if self.n_roots <= self.window && self.n_roots > self.window / 2 {
            self.window += 1;
        }
        self.n_roots -= 1;
    }

    /// A SPOT begins.
    pub(crate) fn begin_spot(&mut self, bytes: usize) {
        self.charge(bytes);
        self.n_spots += 1;
        self.peak_spots = self.peak_spots.max(self.n_spots);
    }

    /// A SPOT is dead.
    pub(crate) fn end_spot(&mut self, bytes: usize) {
        self.release(bytes);
        self.n_spots -= 1;
    }

    /// A question is asked.
    pub(crate) fn begin_question(&mut self, bytes: usize) {
        self.n_questions += 1;
        self.charge(bytes);
    }

    /// The answer was read, or given up.
    pub(crate) fn end_question(&mut self, bytes: usize) {
        self.n_questions -= 1;
        self.release(bytes);
    }

    /// Counts memory.
    pub(crate) fn charge(&mut self, bytes: usize) {
        self.bytes += bytes;
        if self.bytes > self.peak_bytes {
            self.peak_bytes = self.bytes;
            self.questions_at_peak = self.n_questions;
        }
        // Once for all roots that are in flight now: not again before half of them have ended.
        if self.n_roots <= self.window && self.pressure() > Pressure::Start {
            self.window = (self.n_roots / 2).max(1);
        }
    }

    /// Counts memory that is free again.
    pub(crate) fn release(&mut self, bytes: usize) {
        self.bytes -= bytes;
    }

    pub(crate) fn pressure(&self) -> Pressure {
        let eighths = |n| self.share_bytes / 8 * n;
        // One root is always within it.
        if self.bytes == 0 || self.bytes < eighths(4) {
            Pressure::Admit
        } else if self.bytes < eighths(6) {
            Pressure::Start
        } else if self.bytes < eighths(7) {
            Pressure::Resume
        } else {
            Pressure::Full
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pressure_rises_and_falls_with_bytes() {
        let mut budget = Budget::new(800);
        assert_eq!(budget.pressure(), Pressure::Admit);
        budget.begin_spot(400);
        assert_eq!(budget.pressure(), Pressure::Start);
        budget.charge(200);
        assert_eq!(budget.pressure(), Pressure::Resume);
        budget.charge(100);
        assert_eq!(budget.pressure(), Pressure::Full);
        budget.release(300);
        budget.end_spot(400);
        assert_eq!(budget.pressure(), Pressure::Admit);
        assert_eq!((budget.peak_bytes(), budget.peak_spots()), (700, 1));
    }

    #[test]
    fn the_window_grows_with_ends_and_shrinks_with_pressure() {
        let mut budget = Budget::new(8000);
        let admit_all = |budget: &mut Budget| {
            while budget.may_admit() {
                budget.begin_root();
            }
            budget.n_roots
        };
        assert_eq!(admit_all(&mut budget), MIN_FIRST_WINDOW);
        for _ in 0..10 {
            budget.end_root();
        }
        assert_eq!(admit_all(&mut budget), MIN_FIRST_WINDOW + 10);
        // Short of memory twice before anything ends: halved once.
        budget.charge(6001);
        budget.charge(1);
        budget.release(6002);
        assert_eq!(budget.window, MIN_FIRST_WINDOW / 2 + 5);
        while budget.n_roots > budget.window {
            budget.end_root();
        }
        assert_eq!(admit_all(&mut budget), MIN_FIRST_WINDOW / 2 + 5);
    }
}
