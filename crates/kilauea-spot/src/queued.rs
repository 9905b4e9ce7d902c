//! The way in which SPOTs wait: questions travel, and code goes on when answers are there.

use std::cell::RefCell;
use std::pin::Pin;
use std::rc::Rc;
use std::task::{self, Poll};

use crate::cells::{Cells, CellsOf};
use crate::lane::Lane;
use crate::program::{Context, Pool, Program, Runtime};
use crate::slots::Ticket;

/// Pools of one engine thread, whatever the types of their futures.
type PoolList<'a, R> = Rc<RefCell<Vec<LabeledCells<'a, R>>>>;

struct LabeledCells<'a, R> {
    label: &'a str,
    cells: Rc<dyn Cells<R> + 'a>,
}

/// One engine thread's side of [`Runtime`].
pub struct Queued<'a, P: Program> {
    lane: Rc<RefCell<Lane<'a, P>>>,
    pools: PoolList<'a, P::Output>,
}

/// What code of SPOTs sees where questions travel.
pub struct QueuedContext<'a, P: Program> {
    lane: Rc<RefCell<Lane<'a, P>>>,
}

/// A pool of one engine thread.
pub struct QueuedPool<F> {
    cells: Rc<CellsOf<F>>,
    pool: u32,
}

/// Where a SPOT's future is.
#[derive(Clone, Copy)]
pub struct Started {
    pub(crate) pool: u32,
    pub(crate) cell: u32,
}

/// An answer on its way.
pub struct Reply<'a, P: Program> {
    lane: Rc<RefCell<Lane<'a, P>>>,
    /// `None` once read.
    ticket: Option<Ticket>,
}

/// A child on its way.
pub struct ChildOutput<'a, P: Program> {
    lane: Rc<RefCell<Lane<'a, P>>>,
    /// `None` once read.
    ticket: Option<Ticket>,
}

impl<'a, P: Program> Queued<'a, P> {
    pub(crate) fn new(lane: Rc<RefCell<Lane<'a, P>>>) -> Self {
        Self {
            lane,
            pools: Rc::default(),
        }
    }

    /// The same lane and pools.
    pub(crate) fn share(&self) -> Self {
        Self {
            lane: Rc::clone(&self.lane),
            pools: Rc::clone(&self.pools),
        }
    }

    pub(crate) fn context(&self) -> QueuedContext<'a, P> {
        QueuedContext {
            lane: Rc::clone(&self.lane),
        }
    }

    /// Runs a SPOT until it waits or ends.
    pub(crate) fn poll(&self, started: Started) -> Poll<P::Output> {
        self.pools.borrow()[started.pool as usize]
            .cells
            .poll(started.cell)
    }

    /// How to call a SPOT in errors.
    pub(crate) fn label(&self, started: Started) -> &'a str {
        self.pools.borrow()[started.pool as usize].label
    }

    /// Memory that a SPOT's cell takes, with what refers to it.
    pub(crate) fn cell_bytes(&self, started: Started) -> usize {
        let pools = self.pools.borrow();
        pools[started.pool as usize].cells.cell_bytes()
    }

    pub(crate) fn n_cells(&self) -> usize {
        let pools = self.pools.borrow();
        pools.iter().map(|pool| pool.cells.n_allocated()).sum()
    }
}

impl<'a, P: Program + 'a> Runtime<'a, P> for Queued<'a, P> {
    type Context = QueuedContext<'a, P>;
    type Started = Started;
    type Pool<F: Future<Output = P::Output> + 'a> = QueuedPool<F>;

    fn pool<F: Future<Output = P::Output> + 'a>(&self, label: &'a str) -> QueuedPool<F> {
        let cells = Rc::new(CellsOf::new());
        let mut pools = self.pools.borrow_mut();
        pools.push(LabeledCells {
            label,
            cells: Rc::clone(&cells) as Rc<dyn Cells<P::Output> + 'a>,
        });
        QueuedPool {
            cells,
            pool: (pools.len() - 1) as u32,
        }
    }
}

impl<F> Pool<F> for QueuedPool<F> {
    type Started = Started;

    fn start(&self, future: F) -> Started {
        Started {
            pool: self.pool,
            cell: self.cells.insert(future),
        }
    }
}

impl<P: Program> Clone for QueuedContext<'_, P> {
    fn clone(&self) -> Self {
        Self {
            lane: Rc::clone(&self.lane),
        }
    }
}

impl<'a, P: Program> Context<P> for QueuedContext<'a, P> {
    const WAITS: bool = true;

    type Reply = Reply<'a, P>;
    type Child = ChildOutput<'a, P>;

    fn ask(&self, question: P::Question) -> Reply<'a, P> {
        Reply {
            ticket: Some(self.lane.borrow_mut().ask(question)),
            lane: Rc::clone(&self.lane),
        }
    }

    fn spawn(&self, work: P::Work) -> ChildOutput<'a, P> {
        ChildOutput {
            ticket: Some(self.lane.borrow_mut().spawn(work)),
            lane: Rc::clone(&self.lane),
        }
    }
}

impl<P: Program> Future for Reply<'_, P> {
    type Output = P::Answer;

    fn poll(mut self: Pin<&mut Self>, _: &mut task::Context<'_>) -> Poll<P::Answer> {
        let ticket = self.ticket.expect("polled after it was ready");
        let Some(answer) = self.lane.borrow_mut().take_answer(ticket) else {
            return Poll::Pending;
        };
        self.ticket = None;
        Poll::Ready(answer)
    }
}

impl<P: Program> Drop for Reply<'_, P> {
    fn drop(&mut self) {
        if let Some(ticket) = self.ticket {
            self.lane.borrow_mut().discard_answer(ticket);
        }
    }
}

impl<P: Program> Future for ChildOutput<'_, P> {
    type Output = P::Output;

    fn poll(mut self: Pin<&mut Self>, _: &mut task::Context<'_>) -> Poll<P::Output> {
        let ticket = self.ticket.expect("polled after it was ready");
        let Some(output) = self.lane.borrow_mut().take_output(ticket) else {
            return Poll::Pending;
        };
        self.ticket = None;
        Poll::Ready(output)
    }
}

impl<P: Program> Drop for ChildOutput<'_, P> {
    fn drop(&mut self) {
        if let Some(ticket) = self.ticket {
            self.lane.borrow_mut().discard_output(ticket);
        }
    }
}
