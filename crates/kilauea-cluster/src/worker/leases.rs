//! The units that a worker has been lent, between the link and the engine threads.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use kilauea_render::{
    Availability, PathShare, PhotonPart, TileResult, TileStart, Unit, UnitError, UnitOrder,
    UnitSource,
};
use tokio::sync::mpsc;

use super::paths::SharedPaths;
use crate::protocol::{Frame, Lease, LeaseStart, Message, UnitDone, UnitDropped, UnitRefused};

/// How long engine threads wait before they look whether the frame goes on.
const MOMENT: Duration = Duration::from_millis(20);

/// What has been lent and not yet rendered: as many units as the console lends one worker at a time.
pub(crate) struct Leases {
    state: Mutex<State>,
    changed: Condvar,
    paths: SharedPaths,
    outbox: mpsc::Sender<Frame>,
    epoch: u32,
}

#[derive(Default)]
struct State {
    waiting: VecDeque<(u64, UnitOrder)>,
    /// Taken by an engine thread.
    taken: Vec<(u64, Unit)>,
    n_passes_over: u32,
    is_closed: bool,
}

impl Leases {
    /// Of a worker that keeps `photon_part` where photons are divided.
    pub(crate) fn new(
        outbox: mpsc::Sender<Frame>,
        epoch: u32,
        photon_part: Option<PhotonPart>,
    ) -> Self {
        Self {
            state: Mutex::default(),
            changed: Condvar::new(),
            paths: SharedPaths::new(outbox.clone(), epoch, photon_part),
            outbox,
            epoch,
        }
    }

    /// Takes a lease, and the sums that came with it.
    pub(crate) fn add(&self, lease: Lease, sums: &[u8]) {
        let start = match lease.start {
            LeaseStart::Empty => TileStart::Empty,
            LeaseStart::Kept => TileStart::Kept,
            LeaseStart::Sums => TileStart::Sums(sums.to_vec()),
        };
        let order = UnitOrder {
            unit: lease.unit,
            start,
        };
        self.lock().waiting.push_back((lease.id, order));
        self.changed.notify_all();
    }

    /// No units of the first passes will come any more.
    pub(crate) fn set_passes_over(&self, n_passes: u32) {
        self.lock().n_passes_over = n_passes;
        self.changed.notify_all();
    }

    /// The paths that all workers of the frame need.
    pub(crate) fn paths(&self) -> &SharedPaths {
        &self.paths
    }

    /// No units at all will come any more.
    pub(crate) fn close(&self) {
        self.lock().is_closed = true;
        self.changed.notify_all();
        // Last: who then goes on without what paths left must find no units.
        self.paths.close();
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The lease of a unit that an engine thread had.
    fn end(&self, unit: &Unit) -> Option<u64> {
        let taken = &mut self.lock().taken;
        let at = taken.iter().position(|(_, of)| of == unit)?;
        Some(taken.swap_remove(at).0)
    }

    /// Waits while the link is slow. Where it is gone, the frame ends soon.
    fn send(&self, frame: Frame) {
        if self.outbox.blocking_send(frame).is_err() {
            self.close();
        }
    }
}

impl State {
    fn position(&self, passes: &Range<u32>) -> Option<usize> {
        let mut waiting = self.waiting.iter();
        waiting.position(|(_, order)| passes.contains(&order.unit.passes.start))
    }

    fn availability(&self, passes: &Range<u32>) -> Availability {
        if self.is_closed {
            Availability::Over
        } else if self.position(passes).is_some() {
            Availability::Ready
        } else if passes.end <= self.n_passes_over {
            Availability::Over
        } else {
            Availability::NotYet
        }
    }
}

impl UnitSource for Leases {
    fn path_share(&self) -> Option<&dyn PathShare> {
        Some(&self.paths)
    }

    fn has_results(&self, passes: &Range<u32>) -> bool {
        passes.end <= self.lock().n_passes_over
    }

    fn wait(&self, passes: &Range<u32>) -> Availability {
        let is_open = |state: &mut State| state.availability(passes) == Availability::NotYet;
        let waited = self
            .changed
            .wait_timeout_while(self.lock(), MOMENT, is_open);
        let (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        state.availability(passes)
    }

    fn look(&self, passes: &Range<u32>) -> Availability {
        self.lock().availability(passes)
    }

    fn take(&self, passes: &Range<u32>) -> Option<UnitOrder> {
        let mut state = self.lock();
        let at = state.position(passes)?;
        let (lease, order) = state.waiting.remove(at)?;
        state.taken.push((lease, order.unit.clone()));
        Some(order)
    }

    fn done(&self, result: TileResult) {
        let TileResult { unit, sums, tally } = result;
        if let Some(lease) = self.end(&unit) {
            self.send(UnitDone { lease, unit, tally }.frame(self.epoch, &sums));
        }
    }

    fn refused(&self, unit: Unit, error: UnitError) {
        if let Some(lease) = self.end(&unit) {
            let reason = error.to_string();
            self.send(
                UnitRefused {
                    lease,
                    unit,
                    reason,
                }
                .frame(self.epoch, &[]),
            );
        }
    }

    fn dropped(&self, unit: Unit) {
        if let Some(lease) = self.end(&unit) {
            self.send(UnitDropped { lease, unit }.frame(self.epoch, &[]));
        }
    }
}
