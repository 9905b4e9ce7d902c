//! Questions and answers as bytes, through channels within the process.
//!
//! What a link to another machine does, without the machine: it shows that nothing but bytes has
//! to cross.

use std::num::NonZeroU32;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::scope;

use crate::error::RunError;
use crate::program::{Answerer, Program};
use crate::server::{Desk, Server, fail_on_error, spawn_boxed};
use crate::slots::Ticket;
use crate::wire::{Wire, WireError};

/// Batches that a byte channel holds. When it is full, its sender waits: the near side for the
/// far side, the far side for the one that brings answers home, and that one for nobody.
const CHANNEL_CAPACITY: usize = 4;

/// Answers on the far side of two byte channels.
pub struct Bytes<'a, A> {
    answerer: &'a A,
}

impl<'a, A> Bytes<'a, A> {
    /// Serves what `answerer` answers.
    pub fn new(answerer: &'a A) -> Self {
        Self { answerer }
    }
}

impl<P, A> Server<P> for Bytes<'_, A>
where
    P: Program<Question: Wire, Answer: Wire>,
    A: Answerer<P>,
{
    fn serve(&self, desk: &Desk<'_, P>) {
        let (to_far, at_far) = sync_channel(CHANNEL_CAPACITY);
        let (to_near, at_near) = sync_channel(CHANNEL_CAPACITY);
        scope(|threads| {
            let far_side = move || {
                fail_on_error(desk, "the far side", || {
                    answer_bytes(self.answerer, &at_far, &to_near)
                });
            };
            let near_side =
                move || fail_on_error(desk, "the near side", || bring_home(desk, &at_near));
            spawn_boxed(threads, Box::new(far_side));
            spawn_boxed(threads, Box::new(near_side));
            while let Some(batch) = desk.next_batch() {
                let bytes = encode_batch(batch.thread, &batch.questions);
                if to_far.send(bytes).is_err() {
                    break;
                }
            }
            drop(to_far);
        });
    }
}

/// The far side: it has nothing but bytes and the answerer.
fn answer_bytes<P, A>(
    answerer: &A,
    questions: &Receiver<Vec<u8>>,
    answers: &SyncSender<Vec<u8>>,
) -> Result<(), RunError>
where
    P: Program<Question: Wire, Answer: Wire>,
    A: Answerer<P>,
{
    for bytes in questions {
        let (thread, batch) = decode_batch::<P::Question>(&bytes)?;
        let answered: Vec<_> = batch
            .into_iter()
            .map(|(ticket, question)| (ticket, answerer.answer(question)))
            .collect();
        if answers.send(encode_batch(thread, &answered)).is_err() {
            break;
        }
    }
    Ok(())
}

fn bring_home<P>(desk: &Desk<'_, P>, answers: &Receiver<Vec<u8>>) -> Result<(), RunError>
where
    P: Program<Answer: Wire>,
{
    for bytes in answers {
        let (thread, batch) = decode_batch(&bytes)?;
        desk.deliver(thread, batch);
    }
    Ok(())
}

/// A batch: thread, count, then ticket and value by value.
pub fn encode_batch<T: Wire>(thread: u32, items: &[(Ticket, T)]) -> Vec<u8> {
    let mut bytes = Vec::new();
    thread.encode(&mut bytes);
    (items.len() as u32).encode(&mut bytes);
    for (ticket, value) in items {
        ticket.slot.encode(&mut bytes);
        ticket.round.encode(&mut bytes);
        value.encode(&mut bytes);
    }
    bytes
}

/// Reads what [`encode_batch`] wrote. Never panics, and takes no more memory than the bytes call
/// for.
pub fn decode_batch<T: Wire>(bytes: &[u8]) -> Result<(u32, Vec<(Ticket, T)>), RunError> {
    let malformed = |source| RunError::Malformed {
        n_bytes: bytes.len(),
        source,
    };
    let mut rest = bytes;
    let batch = decode_items(&mut rest).map_err(malformed)?;
    if !rest.is_empty() {
        return Err(malformed(WireError::Long(rest.len())));
    }
    Ok(batch)
}

fn decode_items<T: Wire>(bytes: &mut &[u8]) -> Result<(u32, Vec<(Ticket, T)>), WireError> {
    let thread = u32::decode(bytes)?;
    let n = u32::decode(bytes)? as usize;
    let mut items = Vec::with_capacity(n.min(bytes.len() / size_of::<Ticket>()));
    for _ in 0..n {
        let slot = u32::decode(bytes)?;
        let round = NonZeroU32::decode(bytes)?;
        items.push((Ticket { slot, round }, T::decode(bytes)?));
    }
    Ok((thread, items))
}
