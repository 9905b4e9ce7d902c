//! What the threads of a run share.

use std::collections::VecDeque;
use std::time::Duration;

use crate::backlog::Backlog;
use crate::engine::Limits;
use crate::error::RunError;
use crate::inbox::Inbox;
use crate::program::Program;
use crate::slots::Ticket;
use crate::sync::{AtomicBool, AtomicU64, AtomicUsize, Condvar, Mutex, Ordering, lock, wait};

/// Waiting threads look this often whether the run was cancelled.
const PATIENCE: Duration = Duration::from_millis(20);
/// No root.
const NONE: u64 = u64::MAX;

/// Mailboxes, queues and the state of a run.
pub(crate) struct Exchange<P: Program> {
    pub(crate) inboxes: Vec<Inbox<Mail<P>>>,
    pub(crate) backlogs: Vec<Backlog<Child<P>>>,
    /// By holder of a part of the answers.
    pub(crate) questions: Vec<QuestionQueue<P::Question>>,
    pub(crate) progress: Progress,
    pub(crate) privileges: Privileges,
    idle: Idle,
}

/// What arrives at an engine thread.
pub(crate) enum Mail<P: Program> {
    Answers(Vec<(Ticket, P::Answer)>),
    Output(Home, P::Output),
}

/// A child that has not started.
pub(crate) struct Child<P: Program> {
    pub(crate) work: P::Work,
    pub(crate) generation: u32,
    pub(crate) root: u64,
    pub(crate) home: Home,
}

/// Where the output of a child goes.
#[derive(Clone, Copy)]
pub(crate) struct Home {
    pub(crate) thread: u32,
    pub(crate) spot: u32,
    pub(crate) ticket: Ticket,
}

/// Questions of one engine thread on their way.
#[derive(Debug)]
pub struct Batch<Q> {
    /// Number of the thread that asks.
    pub thread: u32,
    /// Each with the ticket that its answer must carry.
    pub questions: Vec<(Ticket, Q)>,
}

impl<P: Program> Exchange<P> {
    pub(crate) fn new(limits: &Limits, n_parts: usize) -> Self {
        let n_threads = limits.n_threads;
        Self {
            inboxes: (0..n_threads).map(|_| Inbox::new()).collect(),
            backlogs: (0..n_threads).map(|_| Backlog::new(limits.order)).collect(),
            questions: (0..n_parts).map(|_| QuestionQueue::new()).collect(),
            progress: Progress::new(),
            privileges: Privileges::new(n_threads),
            idle: Idle::new(n_threads),
        }
    }

    /// Waits until a thread has mail or is woken.
    pub(crate) fn wait_for_mail(&self, thread: usize) {
        self.inboxes[thread].wait(PATIENCE);
    }

    /// Like `wait_for_mail`, but a child to steal ends the wait too. Returns it if there is one
    /// already.
    pub(crate) fn wait_for_mail_or_child(&self, thread: usize) -> Option<Child<P>> {
        // Say that we wait before looking for the last time: whoever spawns after that look knows.
        self.idle.enter(thread);
        let child = self.steal(thread);
        if child.is_none() {
            self.wait_for_mail(thread);
        }
        self.idle.leave(thread);
        child
    }

    /// Wakes one waiting thread, if any, to steal what was just pushed.
    pub(crate) fn offer(&self) {
        if let Some(thread) = self.idle.pick() {
            self.inboxes[thread].wake();
        }
    }

    /// Takes a child of another thread.
    pub(crate) fn steal(&self, thief: usize) -> Option<Child<P>> {
        let n = self.backlogs.len();
        (1..n).find_map(|i| self.backlogs[(thief + i) % n].steal())
    }

    /// Counts a root as done, and ends the run with the last.
    pub(crate) fn end_root(&self, root: u64) {
        self.privileges
            .withdraw(root, |thread| self.inboxes[thread].wake());
        if self.progress.release() {
            self.end(None);
        }
    }

    /// Gives `root` the privilege of `thread` and tells all threads.
    pub(crate) fn privilege(&self, thread: usize, root: u64) {
        self.privileges.grant(thread, root);
        self.inboxes.iter().for_each(Inbox::wake);
    }

    /// Ends the run. The first error stays.
    pub(crate) fn end(&self, error: Option<RunError>) {
        self.progress.end(error);
        self.inboxes.iter().for_each(Inbox::wake);
        self.questions.iter().for_each(QuestionQueue::close);
    }
}

/// Batches of questions on their way to those who answer.
///
/// *Capacity*: the sum of the engine threads' credits, as a thread sends no more questions than
/// it has credit for; so senders never find it full and never wait. Answerers wait while it is
/// empty. They in turn never wait for engine threads, as inboxes have room for every answer.
pub(crate) struct QuestionQueue<Q> {
    state: Mutex<QueueState<Q>>,
    arrived: Condvar,
}

struct QueueState<Q> {
    batches: VecDeque<Batch<Q>>,
    /// Those that wait here and those that were taken and are not answered.
    n_unanswered: usize,
    is_closed: bool,
}

impl<Q> QuestionQueue<Q> {
    pub(crate) fn new() -> Self {
        Self {
            state: Mutex::new(QueueState {
                batches: VecDeque::new(),
                n_unanswered: 0,
                is_closed: false,
            }),
            arrived: Condvar::new(),
        }
    }

    pub(crate) fn push(&self, batch: Batch<Q>) {
        let mut state = lock(&self.state);
        state.batches.push_back(batch);
        state.n_unanswered += 1;
        drop(state);
        self.arrived.notify_one();
    }

    /// The next batch; `None` once the queue is closed, whatever is left in it.
    pub(crate) fn pop(&self) -> Option<Batch<Q>> {
        let mut state = lock(&self.state);
        loop {
            if state.is_closed {
                return None;
            }
            if let Some(batch) = state.batches.pop_front() {
                return Some(batch);
            }
            state = wait(&self.arrived, state, PATIENCE);
        }
    }

    /// Batches that were sent and not [answered](Self::answered).
    pub(crate) fn n_unanswered(&self) -> usize {
        lock(&self.state).n_unanswered
    }

    /// One that was taken is answered.
    pub(crate) fn answered(&self) {
        lock(&self.state).n_unanswered -= 1;
    }

    /// The next batch if there is one.
    pub(crate) fn try_pop(&self) -> Option<Batch<Q>> {
        let mut state = lock(&self.state);
        if state.is_closed {
            return None;
        }
        state.batches.pop_front()
    }

    pub(crate) fn is_closed(&self) -> bool {
        lock(&self.state).is_closed
    }

    pub(crate) fn close(&self) {
        lock(&self.state).is_closed = true;
        self.arrived.notify_all();
    }
}

/// How far a run is: which roots were admitted, and how it ended.
pub(crate) struct Progress {
    next_root: AtomicU64,
    n_in_flight: AtomicUsize,
    /// The job has no more roots.
    is_exhausted: AtomicBool,
    has_ended: AtomicBool,
    error: Mutex<Option<RunError>>,
}

impl Progress {
    pub(crate) fn new() -> Self {
        Self {
            next_root: AtomicU64::new(0),
            n_in_flight: AtomicUsize::new(0),
            is_exhausted: AtomicBool::new(false),
            has_ended: AtomicBool::new(false),
            error: Mutex::new(None),
        }
    }

    /// Counts one more root in flight and gives it its number, unless all were admitted.
    pub(crate) fn reserve(&self) -> Option<u64> {
        if self.is_exhausted() {
            return None;
        }
        self.n_in_flight.fetch_add(1, Ordering::SeqCst);
        Some(self.next_number())
    }

    /// The number of the next root, not counted as in flight.
    #[inline]
    pub(crate) fn next_number(&self) -> u64 {
        self.next_root.fetch_add(1, Ordering::SeqCst)
    }

    /// Notes that there are no more roots. Whoever does so still holds a reservation, so the run
    /// ends with the release of that or of a later one.
    pub(crate) fn exhaust(&self) {
        self.is_exhausted.store(true, Ordering::SeqCst);
    }

    /// Counts one root less in flight; true if it was the last.
    pub(crate) fn release(&self) -> bool {
        self.n_in_flight.fetch_sub(1, Ordering::SeqCst) == 1 && self.is_exhausted()
    }

    pub(crate) fn is_exhausted(&self) -> bool {
        self.is_exhausted.load(Ordering::SeqCst)
    }

    pub(crate) fn has_ended(&self) -> bool {
        self.has_ended.load(Ordering::Acquire)
    }

    /// Ends the run. The first error stays.
    pub(crate) fn end(&self, error: Option<RunError>) {
        if let Some(error) = error {
            lock(&self.error).get_or_insert(error);
        }
        self.has_ended.store(true, Ordering::Release);
    }

    /// The error with which the run ended.
    pub(crate) fn take_error(&self) -> Option<RunError> {
        lock(&self.error).take()
    }
}

/// Roots that go on although memory is short: one for each thread that is out of it.
///
/// Every thread does the work of every privileged root, whatever its own pressure. So such a root
/// always comes to an end, and memory returns. Beyond the budget there is never more than what
/// as many roots as there are threads lead to.
pub(crate) struct Privileges {
    /// By thread.
    roots: Vec<AtomicU64>,
}

impl Privileges {
    pub(crate) fn new(n_threads: usize) -> Self {
        Self {
            roots: (0..n_threads).map(|_| AtomicU64::new(NONE)).collect(),
        }
    }

    pub(crate) fn has(&self, thread: usize) -> bool {
        self.roots[thread].load(Ordering::Acquire) != NONE
    }

    pub(crate) fn grant(&self, thread: usize, root: u64) {
        self.roots[thread].store(root, Ordering::Release);
    }

    /// Writes all privileged roots to `into`.
    pub(crate) fn list(&self, into: &mut Vec<u64>) {
        into.clear();
        into.extend(
            self.roots
                .iter()
                .map(|root| root.load(Ordering::Acquire))
                .filter(|&root| root != NONE),
        );
    }

    /// Takes the privilege from a root that is done, and calls `wake` for each thread that had
    /// given it.
    pub(crate) fn withdraw(&self, root: u64, wake: impl Fn(usize)) {
        for (thread, slot) in self.roots.iter().enumerate() {
            // The root ends once, so nobody grants it anew between load and store.
            if slot.load(Ordering::Acquire) == root {
                slot.store(NONE, Ordering::Release);
                wake(thread);
            }
        }
    }
}

/// Which threads wait and would steal.
pub(crate) struct Idle {
    n_idle: AtomicUsize,
    is_idle: Vec<AtomicBool>,
}

impl Idle {
    pub(crate) fn new(n_threads: usize) -> Self {
        Self {
            n_idle: AtomicUsize::new(0),
            is_idle: (0..n_threads).map(|_| AtomicBool::new(false)).collect(),
        }
    }

    pub(crate) fn enter(&self, thread: usize) {
        self.is_idle[thread].store(true, Ordering::SeqCst);
        self.n_idle.fetch_add(1, Ordering::SeqCst);
    }

    pub(crate) fn leave(&self, thread: usize) {
        self.n_idle.fetch_sub(1, Ordering::SeqCst);
        self.is_idle[thread].store(false, Ordering::SeqCst);
    }

    /// A waiting thread that nobody picked since it began to wait.
    pub(crate) fn pick(&self) -> Option<usize> {
        if self.n_idle.load(Ordering::SeqCst) == 0 {
            return None;
        }
        (0..self.is_idle.len()).find(|&thread| self.is_idle[thread].swap(false, Ordering::SeqCst))
    }
}
