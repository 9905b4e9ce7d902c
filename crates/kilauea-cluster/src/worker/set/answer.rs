//! Threads that answer what other members ask.

use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use kilauea_render::{Packing, PreparedScene};
use tokio::sync::mpsc;

use crate::protocol::{Failed, Frame, FrameError, FrameKind, Message};

/// Batches that wait to be answered; links are not read where there are more.
pub(super) const MAX_BATCHES_WAITING: usize = 16;

/// What a member asks.
pub(super) struct Batch {
    pub(super) number: u16,
    pub(super) rays: Vec<u8>,
    /// To where it is sent from.
    pub(super) answers: mpsc::Sender<Result<Frame, FrameError>>,
}

/// Answers batches on so many threads until there is nobody who could ask.
pub(super) fn start_answering(
    batches: mpsc::Receiver<Batch>,
    prepared: &Arc<PreparedScene>,
    packing: Packing,
    n_threads: usize,
    failed: &mpsc::Sender<Frame>,
    epoch: u32,
) -> io::Result<()> {
    let batches = Arc::new(Mutex::new(batches));
    for i in 0..n_threads.max(1) {
        let batches = Arc::clone(&batches);
        let prepared = Arc::clone(prepared);
        let failed = failed.clone();
        let answer = move || {
            // The lock is let go before the answer is found.
            let next = || lock(&batches).blocking_recv();
            while let Some(batch) = next() {
                let answered = catch_unwind(AssertUnwindSafe(|| batch.answer(&prepared, packing)));
                if answered.is_err() {
                    let reason =
                        "internal error: a worker panicked as it answered another; its message is \
                         on stderr"
                            .to_owned();
                    // Where nobody takes it any more, the frame is over anyway.
                    let _ = failed.blocking_send(Failed { reason }.frame(epoch, &[]));
                    return;
                }
            }
        };
        let builder = thread::Builder::new().name(format!("answers others {i}"));
        builder.spawn(answer)?;
    }
    Ok(())
}

impl Batch {
    fn answer(self, prepared: &PreparedScene, packing: Packing) {
        let hits = prepared.answer_batch(&self.rays, packing);
        let answer = hits.map_err(|error| FrameError::Body {
            kind: FrameKind::Rays,
            reason: error.to_string(),
        });
        let answer = answer.map(|hits| Frame {
            batch: self.number,
            // Frames with hits are told apart by their link and number, not by a life.
            ..Frame::new(FrameKind::Hits, 0, hits)
        });
        // A link that has ended needs no answer.
        let _ = self.answers.blocking_send(answer);
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
