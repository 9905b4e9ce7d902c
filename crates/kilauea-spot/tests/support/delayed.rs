//! A server that makes everybody wait, each question for another time.

use std::time::{Duration, Instant};

use kilauea_spot::{Answerer, Desk, Program, Server, Ticket};

use super::hall::mix;

/// Steps into which the delay is divided.
const N_TICKS: usize = 64;

/// Answers each question after a random delay, so in another order than they were asked in, and in
/// groups of any size.
pub(crate) struct Delayed<'a, A> {
    pub(crate) answerer: &'a A,
    pub(crate) max_delay: Duration,
}

/// An answer, and the thread that waits for it.
type Due<A> = (u32, Ticket, A);

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
