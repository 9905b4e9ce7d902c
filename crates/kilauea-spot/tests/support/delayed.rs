//! A server that makes everybody wait, each question for another time.

use std::collections::BinaryHeap;
use std::time::{Duration, Instant};

use kilauea_spot::{Answerer, Desk, Program, Server, Ticket};

use super::hall::mix;

/// Answers each question after a random delay, so in another order than they were asked in, and in
/// groups of any size.
pub(crate) struct Delayed<'a, A> {
    pub(crate) answerer: &'a A,
    pub(crate) max_delay: Duration,
}

/// An answer that is due later. The earliest is the greatest.
struct Due<A> {
    at: Instant,
    thread: u32,
    ticket: Ticket,
    answer: A,
}

impl<P: Program, A: Answerer<P>> Server<P> for Delayed<'_, A> {
    fn serve(&self, desk: &Desk<'_, P>) {
        let mut due: BinaryHeap<Due<P::Answer>> = BinaryHeap::new();
        let mut n_asked = 0;
        while !desk.is_closed() {
            while let Some(batch) = desk.try_next_batch() {
                let now = Instant::now();
                for (ticket, question) in batch.questions {
                    n_asked += 1;
                    let delay_nanos = mix(n_asked) % self.max_delay.as_nanos().max(1) as u64;
                    due.push(Due {
                        at: now + Duration::from_nanos(delay_nanos),
                        thread: batch.thread,
                        ticket,
                        answer: self.answerer.answer(question),
                    });
                }
            }
            let now = Instant::now();
            let mut by_thread: Vec<Vec<(Ticket, P::Answer)>> = Vec::new();
            while due.peek().is_some_and(|first| first.at <= now) {
                let Some(first) = due.pop() else { break };
                let thread = first.thread as usize;
                if thread >= by_thread.len() {
                    by_thread.resize_with(thread + 1, Vec::new);
                }
                by_thread[thread].push((first.ticket, first.answer));
            }
            for (thread, answers) in by_thread.into_iter().enumerate() {
                if !answers.is_empty() {
                    desk.deliver(thread as u32, answers);
                }
            }
            std::thread::sleep(Duration::from_micros(200));
        }
    }
}

impl<A> PartialEq for Due<A> {
    fn eq(&self, other: &Self) -> bool {
        self.at == other.at
    }
}

impl<A> Eq for Due<A> {}

impl<A> PartialOrd for Due<A> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl<A> Ord for Due<A> {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        other.at.cmp(&self.at)
    }
}
