//! Who answers questions that travel.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, channel};
use std::thread::scope;

use crate::error::{RunError, panic_message};
use crate::exchange::{Batch, Exchange, Mail};
use crate::program::{Answerer, Program};
use crate::slots::Ticket;

/// Serves questions, on threads of its own.
///
/// Each question must be answered once, with its ticket, by the thread that asked; when, in which
/// order and in which groups does not matter.
pub trait Server<P: Program>: Sync {
    /// Serves until [`Desk::next_batch`] returns `None`. Called once on each server thread.
    fn serve(&self, desk: &Desk<'_, P>);
}

/// Where a [`Server`] takes questions and leaves answers.
pub struct Desk<'a, P: Program> {
    exchange: &'a Exchange<P>,
}

impl<'a, P: Program> Desk<'a, P> {
    pub(crate) fn new(exchange: &'a Exchange<P>) -> Self {
        Self { exchange }
    }

    /// Waits for questions; `None` when the run is over.
    pub fn next_batch(&self) -> Option<Batch<P::Question>> {
        self.exchange.questions.pop()
    }

    /// Questions that are there already.
    pub fn try_next_batch(&self) -> Option<Batch<P::Question>> {
        self.exchange.questions.try_pop()
    }

    /// Whether the run is over.
    pub fn is_closed(&self) -> bool {
        self.exchange.questions.is_closed()
    }

    /// Sends answers to the thread that asked. Never waits. Answers for a thread that there is not
    /// are dropped.
    pub fn deliver(&self, thread: u32, answers: Vec<(Ticket, P::Answer)>) {
        if let Some(inbox) = self.exchange.inboxes.get(thread as usize) {
            inbox.put(Mail::Answers(answers));
        }
    }

    /// Ends the run with an error.
    pub fn fail(&self, error: RunError) {
        self.exchange.end(Some(error));
    }
}

/// Answers on the server thread, question by question; those that are slow on another one beside
/// it.
pub struct Queue<'a, A> {
    answerer: &'a A,
}

impl<'a, A> Queue<'a, A> {
    /// Serves what `answerer` answers.
    pub fn new(answerer: &'a A) -> Self {
        Self { answerer }
    }
}

impl<P: Program, A: Answerer<P>> Server<P> for Queue<'_, A> {
    fn serve(&self, desk: &Desk<'_, P>) {
        scope(|threads| {
            // Bounded by the credit of those who ask. The thread starts with the first question.
            let mut to_slow = None;
            while let Some(batch) = desk.next_batch() {
                let is_slow = |question: &P::Question| self.answerer.is_slow(question);
                let mut questions = batch.questions;
                let slow: Vec<_> = questions.extract_if(.., |(_, q)| is_slow(q)).collect();
                if !slow.is_empty() {
                    let to_slow = to_slow.get_or_insert_with(|| {
                        let (to_slow, slow) = channel();
                        threads.spawn(move || {
                            fail_on_error(desk, "the one who answers slowly", || {
                                self.answer_slowly(desk, &slow);
                                Ok(())
                            });
                        });
                        to_slow
                    });
                    if to_slow.send((batch.thread, slow)).is_err() {
                        break;
                    }
                }
                desk.deliver(batch.thread, self.answer(questions));
            }
        });
    }
}

impl<A> Queue<'_, A> {
    fn answer<P>(&self, questions: Vec<(Ticket, P::Question)>) -> Vec<(Ticket, P::Answer)>
    where
        P: Program,
        A: Answerer<P>,
    {
        let answer = |(ticket, question)| (ticket, self.answerer.answer(question));
        questions.into_iter().map(answer).collect()
    }

    /// Each answer goes home by itself, until there are no more questions or the run is over.
    fn answer_slowly<P>(&self, desk: &Desk<'_, P>, batches: &Receiver<SlowBatch<P>>)
    where
        P: Program,
        A: Answerer<P>,
    {
        for (thread, questions) in batches {
            for (ticket, question) in questions {
                if desk.is_closed() {
                    return;
                }
                let answer = self.answerer.answer(question);
                desk.deliver(thread, vec![(ticket, answer)]);
            }
        }
    }
}

/// Questions that are slow, and the thread that asked them.
type SlowBatch<P> = (u32, Vec<(Ticket, <P as Program>::Question)>);

/// Ends the run if `run`, on a thread that is called `thread`, cannot go on.
pub(crate) fn fail_on_error<P: Program>(
    desk: &Desk<'_, P>,
    thread: &str,
    run: impl FnOnce() -> Result<(), RunError>,
) {
    match catch_unwind(AssertUnwindSafe(run)) {
        Ok(Ok(())) => {}
        Ok(Err(error)) => desk.fail(error),
        Err(payload) => desk.fail(RunError::ThreadPanicked {
            thread: thread.to_owned(),
            message: panic_message(payload.as_ref()),
        }),
    }
}
