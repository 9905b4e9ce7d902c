//! Paths that are followed for all workers of a frame, between the link and the engine.

use std::collections::{BTreeMap, HashMap, VecDeque};
use std::ops::Range;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use kilauea_render::{PathPass, PathShare, PhotonPart};
use tokio::sync::mpsc;

use crate::protocol::{Failed, Frame, FrameKind, Message, PathsLeft, PathsWanted};

/// What a worker has to do with the paths that a frame's workers follow together.
pub(crate) struct SharedPaths {
    state: Mutex<State>,
    changed: Condvar,
    outbox: mpsc::Sender<Frame>,
    epoch: u32,
    /// What is kept here where photons are divided among a set.
    photon_part: Option<PhotonPart>,
}

#[derive(Default)]
struct State {
    passes: HashMap<PathPass, Pass>,
    is_closed: bool,
}

/// A pass over paths as far as this worker knows it.
#[derive(Default)]
struct Pass {
    /// To be followed here.
    lent: VecDeque<Range<u32>>,
    /// What paths left, by the first of their numbers.
    left: BTreeMap<u32, (u32, Vec<u8>)>,
}

impl Pass {
    /// Whether it is known what all paths left.
    fn is_complete(&self, pass: PathPass) -> bool {
        let n_known: u64 = self.left.values().map(|(n, _)| u64::from(*n)).sum();
        n_known == u64::from(pass.n_paths)
    }
}

impl SharedPaths {
    pub(crate) fn new(
        outbox: mpsc::Sender<Frame>,
        epoch: u32,
        photon_part: Option<PhotonPart>,
    ) -> Self {
        Self {
            state: Mutex::default(),
            changed: Condvar::new(),
            outbox,
            epoch,
            photon_part,
        }
    }

    /// Takes paths that are to be followed here.
    pub(crate) fn lend(&self, pass: PathPass, paths: Range<u32>) {
        let mut state = self.lock();
        state.passes.entry(pass).or_default().lent.push_back(paths);
        self.changed.notify_all();
    }

    /// Takes what paths left. Of photons that are divided only those stay that are kept here, so that
    /// never all of them are here at once.
    pub(crate) fn add(&self, pass: PathPass, paths: &Range<u32>, left: Vec<u8>) {
        let left = match self.photon_part {
            Some(part) => part.thin(pass, left),
            None => left,
        };
        let mut state = self.lock();
        let known = &mut state.passes.entry(pass).or_default().left;
        known.insert(paths.start, (paths.len() as u32, left));
        self.changed.notify_all();
    }

    /// Nobody waits for the frame any more.
    pub(crate) fn close(&self) {
        self.lock().is_closed = true;
        self.changed.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits while the link is slow. Where it is gone, the frame ends soon.
    fn send(&self, frame: Frame) {
        if self.outbox.blocking_send(frame).is_err() {
            self.close();
        }
    }
}

impl PathShare for SharedPaths {
    fn take(&self, pass: PathPass) -> Option<Range<u32>> {
        let is_new = !self.lock().passes.contains_key(&pass);
        if is_new {
            self.lock().passes.insert(pass, Pass::default());
            self.send(PathsWanted { pass }.frame(self.epoch, &[]));
        }
        let nothing_yet = |state: &mut State| {
            let known = state.passes.get(&pass);
            let known = known.is_some_and(|of| of.lent.is_empty() && !of.is_complete(pass));
            known && !state.is_closed
        };
        let state = self.changed.wait_while(self.lock(), nothing_yet);
        let mut state = state.unwrap_or_else(PoisonError::into_inner);
        if state.is_closed {
            return None;
        }
        state.passes.get_mut(&pass)?.lent.pop_front()
    }

    fn put(&self, pass: PathPass, paths: Range<u32>, left: Vec<u8>) {
        let said = PathsLeft {
            pass,
            paths: paths.clone(),
        };
        let frame = said.frame(self.epoch, &left);
        let limit = FrameKind::PathsLeft.limit() as usize;
        if frame.body.len() > limit {
            let (n_paths, n_bytes) = (paths.len(), left.len());
            let reason = format!(
                "what {n_paths} paths of light leave takes {n_bytes} bytes, over the limit of {limit}"
            );
            return self.send(Failed { reason }.frame(self.epoch, &[]));
        }
        self.send(frame);
        self.add(pass, &paths, left);
    }

    fn collect(&self, pass: PathPass) -> Option<Vec<Vec<u8>>> {
        let mut state = self.lock();
        // Who asks has it then, and nobody asks twice.
        let known = state.passes.remove(&pass)?;
        let is_whole = known.is_complete(pass);
        is_whole.then(|| known.left.into_values().map(|(_, left)| left).collect())
    }
}
