//! Children that nobody has started: the part of a thread's work that others may steal.

use crate::priority::{Order, PriorityQueue, Within};
use crate::sync::{AtomicUsize, Mutex, Ordering, lock};

/// Most children of one thread that run on others at a time. It bounds what may arrive in the
/// thread's inbox; with as many stolen, the thieves have enough to do.
pub(crate) const MAX_LENT: usize = 1024;

/// Children spawned on one thread.
///
/// *Capacity*: the open child slots of the thread's SPOTs, which the budget limits. Nobody waits:
/// the owner pushes and pops, thieves find something or go on.
pub(crate) struct Backlog<T> {
    /// Spares the owner the lock while there is nothing. Thieves may see an old value.
    n_waiting: AtomicUsize,
    state: Mutex<State<T>>,
}

struct State<T> {
    queue: PriorityQueue<T>,
    n_lent: usize,
}

impl<T> Backlog<T> {
    pub(crate) fn new(order: Order) -> Self {
        Self {
            n_waiting: AtomicUsize::new(0),
            state: Mutex::new(State {
                queue: PriorityQueue::new(order, Within::Oldest),
                n_lent: 0,
            }),
        }
    }

    /// Adds children of one root, all of one generation. Owner only.
    pub(crate) fn push(&self, generation: u32, root: u64, items: impl Iterator<Item = T>) {
        let mut state = lock(&self.state);
        let mut n_pushed = 0;
        for item in items {
            state.queue.push(generation, root, item);
            n_pushed += 1;
        }
        self.n_waiting.fetch_add(n_pushed, Ordering::Relaxed);
    }

    /// Takes the first child if it is more urgent than `urgency`. Owner only.
    pub(crate) fn pop_above(&self, urgency: usize) -> Option<T> {
        self.take(|queue| (queue.urgency() > urgency).then(|| queue.pop())?)
    }

    /// Takes the first child of the given roots and sets others aside. Owner only.
    pub(crate) fn pop_of(&self, roots: &[u64]) -> Option<T> {
        self.take(|queue| queue.pop_of(roots))
    }

    /// The oldest root whose children were set aside.
    pub(crate) fn oldest_set_aside(&self) -> Option<u64> {
        lock(&self.state).queue.oldest_set_aside()
    }

    /// Takes the first child to another thread, unless too many are there already.
    pub(crate) fn steal(&self) -> Option<T> {
        let mut state = lock(&self.state);
        if state.n_lent >= MAX_LENT {
            return None;
        }
        let item = state.queue.pop()?;
        state.n_lent += 1;
        self.n_waiting.fetch_sub(1, Ordering::Relaxed);
        Some(item)
    }

    /// Notes that `n` stolen children have come home.
    pub(crate) fn give_back(&self, n: usize) {
        lock(&self.state).n_lent -= n;
    }

    fn take(&self, choose: impl FnOnce(&mut PriorityQueue<T>) -> Option<T>) -> Option<T> {
        if self.n_waiting.load(Ordering::Relaxed) == 0 {
            return None;
        }
        let item = choose(&mut lock(&self.state).queue)?;
        self.n_waiting.fetch_sub(1, Ordering::Relaxed);
        Some(item)
    }
}
