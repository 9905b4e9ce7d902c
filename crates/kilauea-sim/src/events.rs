//! What will happen, in order.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

/// Events by time; of those at the same time, the one that was scheduled first comes first.
pub(crate) struct Events<E> {
    heap: BinaryHeap<Reverse<Scheduled<E>>>,
    n_scheduled: u64,
    pub(crate) now: f64,
}

struct Scheduled<E> {
    time: f64,
    number: u64,
    event: E,
}

impl<E> Events<E> {
    pub(crate) fn new() -> Self {
        Self {
            heap: BinaryHeap::new(),
            n_scheduled: 0,
            now: 0.0,
        }
    }

    /// Lets something happen at a time, which must not have passed.
    pub(crate) fn at(&mut self, time: f64, event: E) {
        let number = self.n_scheduled;
        self.n_scheduled += 1;
        self.heap.push(Reverse(Scheduled {
            time: time.max(self.now),
            number,
            event,
        }));
    }

    /// When that will be.
    pub(crate) fn next_time(&self) -> Option<f64> {
        self.heap.peek().map(|Reverse(scheduled)| scheduled.time)
    }

    /// Goes on to what happens next.
    pub(crate) fn next(&mut self) -> Option<E> {
        let Reverse(scheduled) = self.heap.pop()?;
        self.now = scheduled.time;
        Some(scheduled.event)
    }
}

impl<E> Ord for Scheduled<E> {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_time = self.time.total_cmp(&other.time);
        by_time.then(self.number.cmp(&other.number))
    }
}

impl<E> PartialOrd for Scheduled<E> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<E> PartialEq for Scheduled<E> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl<E> Eq for Scheduled<E> {}
