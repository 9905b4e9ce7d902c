//! How much memory SPOTs in flight may take.

/// The bytes that one engine thread has in flight, and its share of the budget.
pub(crate) struct Budget {
    share_bytes: usize,
    bytes: usize,
    peak_bytes: usize,
    n_spots: usize,
    peak_spots: usize,
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
        }
    }

    /// Whether the whole share is not used yet; what [`Order::FirstCome`](crate::Order) asks for.
    pub(crate) fn is_within_share(&self) -> bool {
        self.bytes == 0 || self.bytes < self.share_bytes
    }

    pub(crate) fn peak_bytes(&self) -> usize {
        self.peak_bytes
    }

    pub(crate) fn peak_spots(&self) -> usize {
        self.peak_spots
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

    /// Counts memory.
    pub(crate) fn charge(&mut self, bytes: usize) {
        self.bytes += bytes;
        self.peak_bytes = self.peak_bytes.max(self.bytes);
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
}
