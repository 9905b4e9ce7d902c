//! A frame being rendered by workers, seen from the thread that wants it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use kilauea_scene::{RenderSettings, Scene};
use tokio::sync::Notify;

use crate::console::{ClusterResult, Console};
use crate::error::ClusterError;
use crate::options::ClusterOptions;
use crate::snapshot::Snapshot;
use crate::ticket::Ticket;
use crate::worker::runtime;

/// A frame in the making.
pub struct ClusterJob {
    status: Arc<Status>,
    thread: JoinHandle<Result<ClusterResult, ClusterError>>,
    start: Instant,
}

/// What the console tells while it is at work, and what it is told.
#[derive(Debug, Default)]
pub(crate) struct Status {
    state: Mutex<State>,
    ended: Condvar,
    is_cancelled: AtomicBool,
    cancel: Notify,
}

#[derive(Debug, Default)]
struct State {
    fraction_done: f64,
    pids: Vec<u32>,
    /// For workers that somebody else starts.
    tickets: Vec<Ticket>,
    /// Workers that somebody else knows to have ended: epochs and reasons.
    ended: Vec<(u32, String)>,
    /// Workers that are to be added.
    n_added: u32,
    snapshot: Snapshot,
    has_ended: bool,
}

impl ClusterJob {
    /// Starts workers and has them render a frame. `settings.threads` are those
    /// of one worker; 0 shares the cores out.
    pub fn start(
        scene: &Scene,
        settings: &RenderSettings,
        options: ClusterOptions,
    ) -> Result<Self, ClusterError> {
        let console = Console::new(scene, settings, options)?;
        let status = Arc::new(Status::default());
        let thread = std::thread::Builder::new().name("console".into()).spawn({
            let status = Arc::clone(&status);
            move || {
                let _ended = EndOnDrop(&status);
                runtime()?.block_on(console.run(&status))
            }
        })?;
        Ok(Self {
            status,
            thread,
            start: Instant::now(),
        })
    }

    /// Waits until rendering has stopped, or for `timeout`; whether it has.
    pub fn wait(&self, timeout: Duration) -> bool {
        let state = self.status.lock();
        let has_not_ended = |state: &mut State| !state.has_ended;
        let waited = self
            .status
            .ended
            .wait_timeout_while(state, timeout, has_not_ended);
        waited.unwrap_or_else(PoisonError::into_inner).0.has_ended
    }

    /// Fraction of the samples taken, and the seconds left at this speed.
    pub fn progress(&self) -> (f64, Option<f64>) {
        let done = self.status.lock().fraction_done;
        let elapsed = self.start.elapsed().as_secs_f64();
        let left = (done > 0.0).then(|| elapsed * (1.0 - done) / done);
        (done, left)
    }

    /// Processes of the workers; zeros for threads.
    pub fn worker_pids(&self) -> Vec<u32> {
        self.status.lock().pids.clone()
    }

    /// Tickets of workers that are to be started elsewhere, each once.
    pub fn take_tickets(&self) -> Vec<Ticket> {
        std::mem::take(&mut self.status.lock().tickets)
    }

    /// Says that a worker has ended, by the epoch on its ticket: whoever started it may know sooner
    /// than its link does.
    pub fn worker_ended(&self, epoch: u32, reason: String) {
        self.status.lock().ended.push((epoch, reason));
    }

    /// Has one more worker, where a machine has become free: it is started as the others were. Where
    /// the scene is spread over sets it has nothing to do until there are as many as a set has members.
    pub fn add_worker(&self) {
        self.status.lock().n_added += 1;
    }

    /// What the console knows, as of a quarter of a second ago at most.
    pub fn snapshot(&self) -> Snapshot {
        self.status.snapshot()
    }

    pub(crate) fn status(&self) -> &Arc<Status> {
        &self.status
    }

    /// Makes rendering stop soon.
    pub fn cancel(&self) {
        self.status.is_cancelled.store(true, Ordering::Relaxed);
        self.status.cancel.notify_one();
    }

    /// Waits for the end and returns the picture.
    pub fn finish(self) -> Result<ClusterResult, ClusterError> {
        let joined = self.thread.join();
        joined.map_err(|_| ClusterError::Internal("the console panicked"))?
    }
}

impl Status {
    pub(crate) fn set(&self, fraction_done: f64, pids: Vec<u32>, tickets: Vec<Ticket>) {
        let mut state = self.lock();
        state.fraction_done = fraction_done;
        state.pids = pids;
        state.tickets.extend(tickets);
    }

    pub(crate) fn take_ended(&self) -> Vec<(u32, String)> {
        std::mem::take(&mut self.lock().ended)
    }

    pub(crate) fn take_added(&self) -> u32 {
        std::mem::take(&mut self.lock().n_added)
    }

    pub(crate) fn show(&self, snapshot: Snapshot) {
        self.lock().snapshot = snapshot;
    }

    pub(crate) fn snapshot(&self) -> Snapshot {
        self.lock().snapshot.clone()
    }

    pub(crate) fn is_cancelled(&self) -> bool {
        self.is_cancelled.load(Ordering::Relaxed)
    }

    /// Waits until nobody waits for the frame.
    pub(crate) async fn cancelled(&self) {
        self.cancel.notified().await;
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Wakes those who wait for the end, also where the console panicked.
struct EndOnDrop<'a>(&'a Status);

impl Drop for EndOnDrop<'_> {
    fn drop(&mut self) {
        self.0.lock().has_ended = true;
        self.0.ended.notify_all();
    }
}
