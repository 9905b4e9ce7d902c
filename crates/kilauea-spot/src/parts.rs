//! Questions whose data lies in parts: some holders are asked each, and their answers combined.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread::scope;

use crate::error::{RunError, panic_message};
use crate::exchange::Batch;
use crate::program::Program;
use crate::server::{Desk, Server, spawn_boxed};
use crate::slots::Ticket;

/// Batches on their way to a holder. When there are so many, who routes questions waits for the
/// holder, which waits for nobody: it leaves answers where they are combined.
const CHANNEL_CAPACITY: usize = 4;
/// Questions that travel to a holder together, at most.
pub const PART_BATCH: usize = 1024;

/// Data in parts, each with a holder who answers for it.
pub trait Parts<P: Program>: Sync {
    /// Holders, at most 64.
    fn n_parts(&self) -> usize;

    /// The holders to ask, one bit each.
    fn whom(&self, question: &P::Question) -> u64;

    /// Kinds of questions, which travel apart from each other.
    fn n_kinds(&self) -> usize {
        1
    }

    /// The kind of a question.
    fn kind(&self, _question: &P::Question) -> usize {
        0
    }

    /// The answer where nobody is asked.
    fn of_nobody(&self, question: &P::Question) -> P::Answer;

    /// What two holders' answers to the same question amount to. Answers are combined in the order
    /// in which they arrive, which must not matter.
    fn combine(&self, one: P::Answer, other: P::Answer) -> P::Answer;

    /// Batches that a holder may be asked at once: more than one where it is far away, so that it does
    /// not wait for the next while an answer travels.
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

/// Serves questions about data in parts: one thread routes, and one or more ask each holder.
pub struct Split<'a, A> {
    parts: &'a A,
}

impl<'a, A> Split<'a, A> {
    /// Serves what the holders of `parts` answer together.
    pub fn new(parts: &'a A) -> Self {
        Self { parts }
    }
}

/// Questions to one holder, with where their answers are combined.
struct Sealed<Q> {
    slots: Vec<u32>,
    questions: Vec<Q>,
}

impl<Q> Default for Sealed<Q> {
    fn default() -> Self {
        Self {
            slots: Vec::new(),
            questions: Vec::new(),
        }
    }
}

/// A question that not all have answered.
struct Pending<A> {
    thread: u32,
    ticket: Ticket,
    n_open: u32,
    answer: Option<A>,
}

/// Questions under way, by slot. There are no more than the engine threads have credit for.
struct PendingTable<A> {
    slots: Vec<Option<Pending<A>>>,
    free: Vec<u32>,
}

impl<A> PendingTable<A> {
    fn insert(&mut self, pending: Pending<A>) -> u32 {
        if let Some(slot) = self.free.pop() {
            self.slots[slot as usize] = Some(pending);
            return slot;
        }
        self.slots.push(Some(pending));
        self.slots.len() as u32 - 1
    }

    /// Combines an answer with those before. Returns the question's once it has all.
    fn add(&mut self, slot: u32, answer: A, combine: impl Fn(A, A) -> A) -> Option<Pending<A>> {
        let pending = self.slots[slot as usize].as_mut()?;
        pending.answer = Some(match pending.answer.take() {
            None => answer,
            Some(before) => combine(before, answer),
        });
        pending.n_open -= 1;
        if pending.n_open > 0 {
            return None;
        }
        self.free.push(slot);
        self.slots[slot as usize].take()
    }
}

impl<P: Program<Question: Clone>, A: Parts<P>> Server<P> for Split<'_, A> {
    fn serve(&self, desk: &Desk<'_, P>) {
        let pending = &Mutex::new(PendingTable {
            slots: Vec::new(),
            free: Vec::new(),
        });
        scope(|threads| {
            let senders = (0..self.parts.n_parts()).map(|part| {
                let (to_holder, at_holder) = sync_channel(CHANNEL_CAPACITY);
                let at_holder = Arc::new(Mutex::new(at_holder));
                for _ in 0..self.parts.n_batches_out(part).max(1) {
                    let at_holder = Arc::clone(&at_holder);
                    let ask = move || self.ask_holder(part, &at_holder, pending, desk);
                    spawn_boxed(threads, Box::new(ask));
                }
                to_holder
            });
            let senders: Vec<_> = senders.collect();
            self.route(desk, pending, &senders);
        });
    }
}

impl<A> Split<'_, A> {
    /// Sends questions to whom they concern, until the run is over or a holder is gone.
    fn route<P: Program>(
        &self,
        desk: &Desk<'_, P>,
        pending: &Mutex<PendingTable<P::Answer>>,
        senders: &[SyncSender<Sealed<P::Question>>],
    ) where
        A: Parts<P>,
        P::Question: Clone,
    {
        let n_kinds = self.parts.n_kinds();
        let mut open: Vec<Sealed<P::Question>> = Vec::new();
        open.resize_with(senders.len() * n_kinds, Sealed::default);
        let send = |at: usize, open: &mut [Sealed<P::Question>]| {
            let sealed = std::mem::take(&mut open[at]);
            sealed.slots.is_empty() || senders[at / n_kinds].send(sealed).is_ok()
        };
        while let Some(batch) = desk.next_batch() {
            let mut next = Some(batch);
            while let Some(batch) = next {
                self.sort(desk, batch, pending, &mut open);
                for at in 0..open.len() {
                    if open[at].slots.len() >= PART_BATCH && !send(at, &mut open) {
                        return;
                    }
                }
                next = desk.try_next_batch();
            }
            // Nobody asks more for now: do not let those wait who have.
            if !(0..open.len()).all(|at| send(at, &mut open)) {
                return;
            }
        }
    }

    /// Puts questions with others of their kind to the same holders.
    fn sort<P: Program>(
        &self,
        desk: &Desk<'_, P>,
        batch: Batch<P::Question>,
        pending: &Mutex<PendingTable<P::Answer>>,
        open: &mut [Sealed<P::Question>],
    ) where
        A: Parts<P>,
        P::Question: Clone,
    {
        let Batch { thread, questions } = batch;
        let asked: Vec<u64> = questions.iter().map(|(_, q)| self.parts.whom(q)).collect();
        let mut of_nobody = Vec::new();
        let mut table = lock(pending);
        for ((ticket, question), whom) in questions.into_iter().zip(asked) {
            if whom == 0 {
                of_nobody.push((ticket, self.parts.of_nobody(&question)));
                continue;
            }
            let slot = table.insert(Pending {
                thread,
                ticket,
                n_open: whom.count_ones(),
                answer: None,
            });
            let kind = self.parts.kind(&question);
            let mut rest = whom;
            while rest != 0 {
                let part = rest.trailing_zeros() as usize;
                rest &= rest - 1;
                let to = &mut open[part * self.parts.n_kinds() + kind];
                to.slots.push(slot);
                to.questions.push(question.clone());
            }
        }
        drop(table);
        if !of_nobody.is_empty() {
            desk.deliver(thread, of_nobody);
        }
    }

    /// Asks one holder batch after batch, and delivers what has all its answers.
    fn ask_holder<P: Program>(
        &self,
        part: usize,
        batches: &Mutex<Receiver<Sealed<P::Question>>>,
        pending: &Mutex<PendingTable<P::Answer>>,
        desk: &Desk<'_, P>,
    ) where
        A: Parts<P>,
    {
        // The lock is let go before the holder is asked.
        let next = || lock(batches).recv().ok();
        while let Some(Sealed { slots, questions }) = next() {
            let asked = catch_unwind(AssertUnwindSafe(|| self.parts.answer(part, questions)));
            let answers = match asked {
                Ok(Ok(answers)) => answers,
                Ok(Err(error)) => return desk.fail(error),
                Err(payload) => {
                    return desk.fail(RunError::ThreadPanicked {
                        thread: format!("holder {part}"),
                        message: panic_message(payload.as_ref()),
                    });
                }
            };
            // By engine thread.
            let mut complete: Vec<Vec<(Ticket, P::Answer)>> = Vec::new();
            let mut table = lock(pending);
            for (slot, answer) in slots.into_iter().zip(answers) {
                let added = table.add(slot, answer, |a, b| self.parts.combine(a, b));
                let Some(Pending {
                    thread,
                    ticket,
                    answer: Some(answer),
                    ..
                }) = added
                else {
                    continue;
                };
                let thread = thread as usize;
                if complete.len() <= thread {
                    complete.resize_with(thread + 1, Vec::new);
                }
                complete[thread].push((ticket, answer));
            }
            drop(table);
            for (thread, answers) in (0..).zip(complete) {
                if !answers.is_empty() {
                    desk.deliver(thread, answers);
                }
            }
        }
    }
}

/// Locks. What is combined under the lock is the user's code: if it panics, the run ends.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
}
