//! Who answers questions that travel.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::thread::{Scope, scope};

use crate::departures::Route;
use crate::error::{RunError, panic_message};
use crate::exchange::{Batch, Exchange, Mail, QuestionQueue};
use crate::program::{Answerer, Program};
use crate::slots::Ticket;

/// Serves questions, on threads of its own.
///
/// Each question must be answered once, with its ticket, by the thread that asked; when, in which
/// order and in which groups does not matter.
pub trait Server<P: Program>: Sync {
    /// Serves until [`Desk::next_batch`] returns `None`. Called once on each server thread.
    fn serve(&self, desk: &Desk<'_, P>);

    /// Holders of parts of the answers, at most 64: each has batches of its own.
    fn n_parts(&self) -> usize {
        1
    }

    /// Kinds of questions, which travel apart from each other.
    fn n_kinds(&self) -> usize {
        1
    }

    /// The kind of a question.
    fn kind(&self, _question: &P::Question) -> usize {
        0
    }

    /// What becomes of a question, on the thread that asks it.
    fn route(&self, question: P::Question) -> Route<P> {
        Route::Asked {
            question,
            whom: 1,
            known: None,
        }
    }

    /// What two answers to the same question amount to. They are combined as they come, so their order
    /// must not matter.
    fn combine(&self, _one: P::Answer, other: P::Answer) -> P::Answer {
        other
    }

    /// Questions of a full batch, where one costs more than the time that it may save: those that are
    /// fewer wait while so many are under way. None where the engine's own batches do.
    fn full_batch(&self) -> Option<usize> {
        None
    }

    /// Batches that a holder may be asked at once.
    fn n_batches_out(&self, _part: usize) -> usize {
        usize::MAX
    }
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
        self.next_batch_to(0)
    }

    /// Waits for questions to one holder of a part; `None` when the run is over.
    pub fn next_batch_to(&self, part: usize) -> Option<Batch<P::Question>> {
        self.exchange.questions[part].pop()
    }

    /// Notes that a batch to a holder of a part is answered. Before its answers are delivered: whoever
    /// they wake may have held questions back for this.
    pub(crate) fn answered(&self, part: usize) {
        self.exchange.questions[part].answered();
    }

    /// Questions that are there already.
    pub fn try_next_batch(&self) -> Option<Batch<P::Question>> {
        self.exchange.questions[0].try_pop()
    }

    /// Whether the run is over.
    pub fn is_closed(&self) -> bool {
        self.exchange.questions[0].is_closed()
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

/// Threads beside each server thread for what is slow. Disks and networks answer several at a time.
const N_SLOW_THREADS: usize = 4;

/// Answers on the server thread, question by question; those that are slow on others beside it.
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
        let slow = &QuestionQueue::new();
        scope(|threads| {
            let _close = CloseOnDrop(slow);
            let mut n_slow_threads = 0;
            while let Some(mut batch) = desk.next_batch() {
                let thread = batch.thread;
                let is_slow = |asked: &mut (_, _)| self.answerer.is_slow(&asked.1);
                for asked in batch.questions.extract_if(.., is_slow) {
                    let questions = vec![asked];
                    slow.push(Batch { thread, questions });
                    if n_slow_threads < N_SLOW_THREADS {
                        let answer = || self.answer_slowly(desk, slow);
                        spawn_boxed(threads, Box::new(answer));
                        n_slow_threads += 1;
                    }
                }
                self.answer(desk, batch);
            }
        });
    }
}

impl<A> Queue<'_, A> {
    fn answer<P>(&self, desk: &Desk<'_, P>, batch: Batch<P::Question>)
    where
        P: Program,
        A: Answerer<P>,
    {
        let answer = |(ticket, question)| (ticket, self.answerer.answer(question));
        desk.deliver(
            batch.thread,
            batch.questions.into_iter().map(answer).collect(),
        );
    }

    fn answer_slowly<P>(&self, desk: &Desk<'_, P>, slow: &QuestionQueue<P::Question>)
    where
        P: Program,
        A: Answerer<P>,
    {
        fail_on_error(desk, "one who answers slowly", || {
            while let Some(batch) = slow.pop()
                && !desk.is_closed()
            {
                self.answer(desk, batch);
            }
            Ok(())
        });
    }
}

/// Lets those who wait for questions go, however the one ends who has them.
struct CloseOnDrop<'q, Q>(&'q QuestionQueue<Q>);

impl<Q> Drop for CloseOnDrop<'_, Q> {
    fn drop(&mut self) {
        self.0.close();
    }
}

/// Starts a thread by code that all programs share: starting one takes more of it than most answerers
/// have.
pub(crate) fn spawn_boxed<'scope>(
    threads: &'scope Scope<'scope, '_>,
    run: Box<dyn FnOnce() + Send + 'scope>,
) {
    threads.spawn(run);
}

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
