//! Who answers questions that travel.

use crate::error::RunError;
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

/// Answers on the server thread, question by question.
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
        while let Some(batch) = desk.next_batch() {
            let answer = |(ticket, question)| (ticket, self.answerer.answer(question));
            desk.deliver(
                batch.thread,
                batch.questions.into_iter().map(answer).collect(),
            );
        }
    }
}
