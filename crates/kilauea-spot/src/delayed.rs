//! A server that makes everybody wait, each question for another time.

use std::time::{Duration, Instant};

use crate::program::{Answerer, Program};
use crate::server::{Desk, Server};
use crate::slots::Ticket;

/// Steps into which the delay is divided.
const N_TICKS: usize = 64;

/// Answers each question after a random delay, so in another order than they were asked in and in
/// groups of any size: a bad network, for tests and measurements.
pub struct Delayed<'a, A> {
    answerer: &'a A,
    max_delay: Duration,
}

/// An answer, and the thread that waits for it.
type Due<A> = (u32, Ticket, A);

impl<'a, A> Delayed<'a, A> {
    /// Serves what `answerer` answers, after up to `max_delay`.
    pub fn new(answerer: &'a A, max_delay: Duration) -> Self {
        Self {
            answerer,
            max_delay,
        }
    }
}

impl<P: Program, A: Answerer<P>> Server<P> for Delayed<'_, A> {
    fn serve(&self, desk: &Desk<'_, P>) {
        let tick = self.max_delay / N_TICKS as u32;
        let start = Instant::now();
        // What is due at each of the next ticks; the current one is at `n_ticks % N_TICKS`.
        let mut wheel: [Vec<Due<P::Answer>>; N_TICKS] = std::array::from_fn(|_| Vec::new());
        let mut n_ticks = 0;
        let mut n_asked = 0;
        while !desk.is_closed() {
            while let Some(batch) = desk.try_next_batch() {
                for (ticket, question) in batch.questions {
                    n_asked += 1;
                    let delay_ticks = 1 + mix(n_asked) as usize % (N_TICKS - 1);
                    let answer = self.answerer.answer(question);
                    wheel[(n_ticks + delay_ticks) % N_TICKS].push((batch.thread, ticket, answer));
                }
            }
            while start.elapsed() >= tick * n_ticks as u32 {
                deliver(desk, &mut wheel[n_ticks % N_TICKS]);
                n_ticks += 1;
            }
            std::thread::sleep(tick.min(Duration::from_millis(1)));
        }
    }
}

/// Delivers the latest question's answer first.
fn deliver<P: Program>(desk: &Desk<'_, P>, due: &mut Vec<Due<P::Answer>>) {
    let mut by_thread: Vec<Vec<(Ticket, P::Answer)>> = Vec::new();
    for (thread, ticket, answer) in due.drain(..).rev() {
        let thread = thread as usize;
        if thread >= by_thread.len() {
            by_thread.resize_with(thread + 1, Vec::new);
        }
        by_thread[thread].push((ticket, answer));
    }
    for (thread, answers) in by_thread.into_iter().enumerate() {
        if !answers.is_empty() {
            desk.deliver(thread as u32, answers);
        }
    }
}

/// Mixes the bits of a number (Steele, Lea & Flood 2014, SplitMix64).
fn mix(key: u64) -> u64 {
    let mut z = key.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
