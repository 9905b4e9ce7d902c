//! Threads that answer what other members ask.

use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use kilauea_render::{Packing, PreparedScene};
use tokio::sync::mpsc;

use crate::protocol::{Failed, Frame, FrameKind, Message};

/// Batches that wait to be answered; links are not read where there are more.
pub(super) const MAX_BATCHES_WAITING: usize = 16;

/// What a member asks.
pub(super) struct Batch {
    pub(super) number: u16,
    pub(super) rays: Vec<u8>,
    /// To where it is sent from.
    pub(super) answers: mpsc::Sender<Frame>,
}

/// Answers batches on so many threads until there is nobody who could ask. What cannot be answered
/// ends the frame, by way of `failed`: who asks would ask again.
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
                let panicked = "internal error: a worker panicked as it answered another; its \
                                message is on stderr";
                if let Err(reason) = answered.unwrap_or_else(|_| Err(panicked.to_owned())) {
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
    /// Answers, or says in words why that cannot be.
    fn answer(self, prepared: &PreparedScene, packing: Packing) -> Result<(), String> {
        let hits = prepared
            .answer_batch(&self.rays, packing)
            .map_err(|error| format!("internal error: rays of another worker: {error}"))?;
        let limit = FrameKind::Hits.limit();
        if hits.len() > limit as usize {
            let n_bytes = hits.len();
            return Err(format!(
                "what a batch of rays hits takes {n_bytes} bytes, over the limit of {limit}: too many \
                 primvars for a scene that is spread over a set"
            ));
        }
        let frame = Frame {
            batch: self.number,
            // Hits are told apart by their link and number, not by a life.
            ..Frame::new(FrameKind::Hits, 0, hits)
        };
        // A link that has ended needs no answer.
        let _ = self.answers.blocking_send(frame);
        Ok(())
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
