//! Threads that answer what other members ask.

use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc as waiting;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use kilauea_render::{Answered, Packing, PreparedScene};
use tokio::sync::mpsc;

use super::MAX_BATCHES_OUT;
use super::serve::MAX_CONNECTIONS;
use crate::protocol::{Failed, Frame, FrameKind, Message};

/// Batches that wait to be answered; links are not read where there are more.
pub(super) const MAX_BATCHES_WAITING: usize = 16;

/// Batches that wait for photons: as many as all links have credit for, so that who answers never waits
/// to put one there.
const MAX_BATCHES_EARLY: usize = MAX_CONNECTIONS * MAX_BATCHES_OUT;

/// What a member asks.
pub(super) struct Batch {
    pub(super) number: u16,
    pub(super) questions: Vec<u8>,
    /// To where it is sent from.
    pub(super) answers: mpsc::Sender<Frame>,
}

/// Answers batches on so many threads until there is nobody who could ask. What cannot be answered
/// ends the frame, by way of `failed`: who asks would ask again.
///
/// Batches that ask for photons which are not here yet go to a thread that waits for these, so that
/// rays never wait behind them: photons may come by those rays.
pub(super) fn start_answering(
    batches: mpsc::Receiver<Batch>,
    prepared: &Arc<PreparedScene>,
    packing: Packing,
    n_threads: usize,
    failed: &mpsc::Sender<Frame>,
    epoch: u32,
) -> io::Result<()> {
    let answerer = Answerer {
        prepared: Arc::clone(prepared),
        packing,
        failed: failed.clone(),
        epoch,
    };
    let batches = Arc::new(Mutex::new(batches));
    let (later, early) = waiting::sync_channel(MAX_BATCHES_EARLY);
    for i in 0..n_threads.max(1) {
        let batches = Arc::clone(&batches);
        let (answerer, later) = (answerer.clone(), later.clone());
        let answer = move || {
            // The lock is let go before the answer is found.
            let next = || lock(&batches).blocking_recv();
            while let Some(batch) = next() {
                let goes_on = match answerer.answer(batch) {
                    Ok(None) => true,
                    Ok(Some(early)) => later.send(early).is_ok(),
                    Err(()) => false,
                };
                if !goes_on {
                    return;
                }
            }
        };
        let builder = thread::Builder::new().name(format!("answers others {i}"));
        builder.spawn(answer)?;
    }
    let wait = move || {
        for batch in early {
            answerer.prepared.wait_for_photons(&batch.questions);
            if answerer.answer(batch).is_err() {
                return;
            }
        }
    };
    let builder = thread::Builder::new().name("waits for photons".into());
    builder.spawn(wait).map(drop)
}

/// What it takes to answer.
#[derive(Clone)]
struct Answerer {
    prepared: Arc<PreparedScene>,
    packing: Packing,
    failed: mpsc::Sender<Frame>,
    epoch: u32,
}

impl Answerer {
    /// Answers a batch. Gives it back where that must wait for photons; an error where the frame has
    /// ended by it.
    fn answer(&self, batch: Batch) -> Result<Option<Batch>, ()> {
        let find = || batch.find(&self.prepared, self.packing);
        let panicked = "internal error: a worker panicked as it answered another; its message is \
                        on stderr";
        let found = catch_unwind(AssertUnwindSafe(find));
        match found.unwrap_or_else(|_| Err(panicked.to_owned())) {
            Ok(Answered::Now(answers)) => batch.send(answers),
            Ok(Answered::Later) => return Ok(Some(batch)),
            // Who asked will ask the successor.
            Ok(Answered::Never) => {}
            Err(reason) => {
                // Where nobody takes it any more, the frame is over anyway.
                let said = Failed { reason }.frame(self.epoch, &[]);
                let _ = self.failed.blocking_send(said);
                return Err(());
            }
        }
        Ok(None)
    }
}

impl Batch {
    /// Finds the answers, or says in words why that cannot be.
    fn find(&self, prepared: &PreparedScene, packing: Packing) -> Result<Answered, String> {
        let answered = prepared
            .answer_batch(&self.questions, packing)
            .map_err(|error| format!("internal error: questions of another worker: {error}"))?;
        let limit = FrameKind::Hits.limit();
        match &answered {
            Answered::Now(answers) if answers.len() > limit as usize => {
                let n_bytes = answers.len();
                Err(format!(
                    "what a batch of rays hits takes {n_bytes} bytes, over the limit of {limit}: too \
                     many primvars for a scene that is spread over a set"
                ))
            }
            _ => Ok(answered),
        }
    }

    fn send(self, answers: Vec<u8>) {
        let frame = Frame {
            batch: self.number,
            // Hits are told apart by their link and number, not by a life.
            ..Frame::new(FrameKind::Hits, 0, answers)
        };
        // A link that has ended needs no answer.
        let _ = self.answers.blocking_send(frame);
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
