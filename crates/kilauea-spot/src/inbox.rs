//! Where an engine thread gets its mail and waits for it.

use std::time::Duration;

use crate::sync::{AtomicBool, Condvar, Mutex, Ordering, lock, wait};

/// Mail for one engine thread.
///
/// *Capacity*: what the thread has out, which is its credit of questions and its credit of children
/// lent to other threads. Each piece of mail answers one of them, so senders never find it full
/// and never wait. Only the owner waits, and only when it has nothing to do.
pub(crate) struct Inbox<T> {
    /// Spares the owner the lock while there is no mail.
    has_mail: AtomicBool,
    state: Mutex<State<T>>,
    arrived: Condvar,
}

struct State<T> {
    mail: Vec<T>,
    /// Someone called `wake`; stays until the owner has noticed.
    is_woken: bool,
}

impl<T> Inbox<T> {
    pub(crate) fn new() -> Self {
        Self {
            has_mail: AtomicBool::new(false),
            state: Mutex::new(State {
                mail: Vec::new(),
                is_woken: false,
            }),
            arrived: Condvar::new(),
        }
    }

    /// Sends.
    pub(crate) fn put(&self, item: T) {
        let mut state = lock(&self.state);
        state.mail.push(item);
        self.has_mail.store(true, Ordering::Release);
        drop(state);
        self.arrived.notify_one();
    }

    /// Makes the owner look around, now or before it next waits.
    pub(crate) fn wake(&self) {
        lock(&self.state).is_woken = true;
        self.arrived.notify_one();
    }

    /// Moves all mail to the empty `into`.
    pub(crate) fn take(&self, into: &mut Vec<T>) {
        if !self.has_mail.load(Ordering::Acquire) {
            return;
        }
        let mut state = lock(&self.state);
        self.has_mail.store(false, Ordering::Release);
        std::mem::swap(&mut state.mail, into);
    }

    /// Waits for mail or a call of `wake`, at most for `patience`.
    pub(crate) fn wait(&self, patience: Duration) {
        let mut state = lock(&self.state);
        if state.mail.is_empty() && !state.is_woken {
            state = wait(&self.arrived, state, patience);
        }
        state.is_woken = false;
    }
}
