//! Pinned memory for futures of one type, used again and again.

use std::cell::RefCell;
use std::pin::Pin;
use std::task::{Context, Poll, Waker};

/// Cells whose futures have different types but equal outputs.
pub(crate) trait Cells<R> {
    /// Runs a future until it waits or ends. If it ends, its cell is free again.
    fn poll(&self, cell: u32) -> Poll<R>;

    /// Cells allocated so far.
    fn n_allocated(&self) -> usize;

    /// Memory that a cell takes, with what refers to it.
    fn cell_bytes(&self) -> usize;
}

/// Cells for futures of type `F`. Each is allocated once, when no other is free.
pub(crate) struct CellsOf<F> {
    cells: RefCell<Vec<Pin<Box<Option<F>>>>>,
    free: RefCell<Vec<u32>>,
}

impl<F> CellsOf<F> {
    pub(crate) fn new() -> Self {
        Self {
            cells: RefCell::new(Vec::new()),
            free: RefCell::new(Vec::new()),
        }
    }

    /// Puts a future into a free cell.
    pub(crate) fn insert(&self, future: F) -> u32 {
        let mut cells = self.cells.borrow_mut();
        if let Some(cell) = self.free.borrow_mut().pop() {
            cells[cell as usize].as_mut().set(Some(future));
            return cell;
        }
        cells.push(Box::pin(Some(future)));
        (cells.len() - 1) as u32
    }
}

impl<F: Future> Cells<F::Output> for CellsOf<F> {
    fn poll(&self, cell: u32) -> Poll<F::Output> {
        let mut cells = self.cells.borrow_mut();
        let mut pinned = cells[cell as usize].as_mut();
        // The engine itself knows when to poll again, so wakers do nothing.
        let mut context = Context::from_waker(Waker::noop());
        let future = pinned.as_mut().as_pin_mut().expect("the cell is in use");
        let poll = future.poll(&mut context);
        if poll.is_ready() {
            pinned.set(None);
            self.free.borrow_mut().push(cell);
        }
        poll
    }

    fn n_allocated(&self) -> usize {
        self.cells.borrow().len()
    }

    fn cell_bytes(&self) -> usize {
        size_of::<Option<F>>() + size_of::<usize>() + size_of::<u32>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::future::ready;

    #[test]
    fn cells_are_used_again() {
        let cells = CellsOf::new();
        for round in 0..100 {
            let first = cells.insert(ready(round));
            let second = cells.insert(ready(-round));
            assert_eq!(cells.poll(second), Poll::Ready(-round));
            assert_eq!(cells.poll(first), Poll::Ready(round));
        }
        assert_eq!(cells.n_allocated(), 2);
    }
}
