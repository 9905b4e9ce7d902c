//! Questions whose data lies in parts: some holders are asked each, and their answers combined.
//!
//! The engine thread that asks decides whom, and combines: nobody stands between it and the holders.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::thread::scope;

use crate::departures::Route;
use crate::error::{RunError, panic_message};
use crate::exchange::Batch;
use crate::program::Program;
use crate::server::{Desk, Server, spawn_boxed};

/// Questions that travel to a holder together, at most.
pub const PART_BATCH: usize = 1024;

/// Data in parts, each with a holder who answers for it.
pub trait Parts<P: Program>: Sync {
    /// Holders, at most 64.
    fn n_parts(&self) -> usize;

    /// The holders to ask, or the answer where nobody needs to be. On the thread that asks, which may
    /// be a holder itself and know a part of the answer.
    fn route(&self, question: P::Question) -> Route<P>;

    /// Kinds of questions, which travel apart from each other.
    fn n_kinds(&self) -> usize {
        1
    }

    /// The kind of a question.
    fn kind(&self, _question: &P::Question) -> usize {
        0
    }

    /// What two holders' answers to the same question amount to. Answers are combined in the order
    /// in which they arrive, which must not matter.
    fn combine(&self, one: P::Answer, other: P::Answer) -> P::Answer;

    /// Batches that a holder may be asked at once: more than one where it is far away, so that it does
    /// not wait for the next while an answer travels; none where who asks is the holder, and
    /// [`Self::route`] never says that it is to be asked.
    fn n_batches_out(&self, _part: usize) -> usize {
        1
    }

    /// A holder's answers, in the order of the questions, which are of one kind. Called on as many
    /// threads at once as it may be asked batches.
    ///
    /// # Errors
    /// If the holder cannot be asked, or what it says cannot be read: the run ends.
    fn answer(&self, part: usize, questions: Vec<P::Question>) -> Result<Vec<P::Answer>, RunError>;
}

/// Serves questions about data in parts: one thread or more ask each holder.
pub struct Split<'a, A> {
    parts: &'a A,
}

impl<'a, A> Split<'a, A> {
    /// Serves what the holders of `parts` answer together.
    pub fn new(parts: &'a A) -> Self {
        Self { parts }
    }
}

impl<P: Program, A: Parts<P>> Server<P> for Split<'_, A> {
    fn serve(&self, desk: &Desk<'_, P>) {
        scope(|threads| {
            for part in 0..self.parts.n_parts() {
                for _ in 0..self.parts.n_batches_out(part) {
                    spawn_boxed(threads, Box::new(move || self.ask_holder(part, desk)));
                }
            }
        });
    }

    fn n_parts(&self) -> usize {
        self.parts.n_parts()
    }

    fn n_kinds(&self) -> usize {
        self.parts.n_kinds()
    }

    fn kind(&self, question: &P::Question) -> usize {
        self.parts.kind(question)
    }

    fn route(&self, question: P::Question) -> Route<P> {
        self.parts.route(question)
    }

    fn combine(&self, one: P::Answer, other: P::Answer) -> P::Answer {
        self.parts.combine(one, other)
    }

    fn full_batch(&self) -> Option<usize> {
        Some(PART_BATCH)
    }

    fn n_batches_out(&self, part: usize) -> usize {
        self.parts.n_batches_out(part)
    }
}

impl<A> Split<'_, A> {
    /// Asks one holder batch after batch.
    fn ask_holder<P: Program>(&self, part: usize, desk: &Desk<'_, P>)
    where
        A: Parts<P>,
    {
        while let Some(Batch { thread, questions }) = desk.next_batch_to(part) {
            let (tickets, questions): (Vec<_>, Vec<_>) = questions.into_iter().unzip();
            let asked = catch_unwind(AssertUnwindSafe(|| self.parts.answer(part, questions)));
            desk.answered(part);
            match asked {
                Ok(Ok(answers)) => desk.deliver(thread, tickets.into_iter().zip(answers).collect()),
                Ok(Err(error)) => return desk.fail(error),
                Err(payload) => {
                    return desk.fail(RunError::ThreadPanicked {
                        thread: format!("holder {part}"),
                        message: panic_message(payload.as_ref()),
                    });
                }
            }
        }
    }
}
