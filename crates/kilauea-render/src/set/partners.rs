//! Members of a set that are other processes: how they are asked, and how they answer.

use std::sync::Arc;

use kilauea_spot::{RunError, WireError};

use super::server::{answer_bytes, malformed};
use super::wire::{Packing, decode_answers, encode_questions, pack, unpack};
use crate::integrator::{Answer, Blame, Question, RayTracer};
use crate::prepared::PreparedScene;

/// The other members of a set, as the one that is this process reaches them.
///
/// A batch of questions has the same answer whoever gives it and how often it is asked, so that one
/// whose answer is lost is sent to the member's successor.
pub trait Partners: Send + Sync {
    /// Has a member answer a batch. Waits, also while another takes the member's place; called on
    /// several threads at once.
    fn ask(&self, member: usize, batch: Vec<u8>) -> Result<Vec<u8>, PartnersGone>;

    /// Batches that one member may be asked at once.
    fn n_batches_out(&self) -> usize;
}

/// Nobody can be asked any more, as the frame is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the set is no more")]
pub struct PartnersGone;

/// A member that is another process.
pub(super) struct Remote {
    pub(super) number: usize,
    pub(super) partners: Arc<dyn Partners>,
    pub(super) packing: Packing,
}

/// Answers that came over a link.
pub(super) struct Asked {
    pub(super) answers: Vec<Answer>,
    /// Bytes that went and came.
    pub(super) n_bytes: [usize; 2],
}

impl Remote {
    /// Asks a batch.
    pub(super) fn ask(&self, questions: &[Question]) -> Result<Asked, RunError> {
        let batch = pack(encode_questions(questions, self.packing), self.packing);
        let n_bytes_sent = batch.len();
        let reply = self.partners.ask(self.number, batch);
        let reply = reply.map_err(|error| RunError::Unanswered {
            part: self.number,
            reason: error.to_string(),
        })?;
        let answers = unpack(&reply).and_then(|body| decode_answers(questions, body.into_owned()));
        Ok(Asked {
            answers: answers.map_err(|source| malformed(&reply, source))?,
            n_bytes: [n_bytes_sent, reply.len()],
        })
    }
}

impl PreparedScene {
    /// Answers a batch that another member of the set asks: what rays meet of the part that is here.
    ///
    /// # Errors
    /// If the bytes are no batch.
    pub fn answer_batch(&self, batch: &[u8], packing: Packing) -> Result<Vec<u8>, WireError> {
        let blame = &Blame::default();
        // A surface that lets rays pass is asked for it wherever there is one.
        if self.needs.cutouts || self.needs.nested_media {
            let tracer = RayTracer::<true>::of_part(&self.geometry, &self.textures, blame);
            answer_bytes(batch, packing, |question| tracer.answer_of_part(question))
        } else {
            let tracer = RayTracer::<false>::of_part(&self.geometry, &self.textures, blame);
            answer_bytes(batch, packing, |question| tracer.answer_of_part(question))
        }
    }
}
