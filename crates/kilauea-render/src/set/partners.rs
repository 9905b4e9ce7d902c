//! Members of a set that are other processes: how they are asked, and how they answer.

use std::sync::Arc;

use kilauea_spot::{RunError, WireError};

use super::photons::Found;
use super::server::{answer_all, ask_all};
use super::wire::{Packing, decode_questions, unpack};
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
    pub(super) fn ask(&self, questions: Vec<Question>) -> Result<Asked, RunError> {
        ask_all(questions, self.packing, |batch| {
            let reply = self.partners.ask(self.number, batch);
            reply.map_err(|error| RunError::Unanswered {
                part: self.number,
                reason: error.to_string(),
            })
        })
    }
}

/// What comes of a batch that another member asks.
pub enum Answered {
    /// Its answers.
    Now(Vec<u8>),
    /// It asks for photons that are not here yet. Who waits for them must not keep others from being
    /// answered: it may be their rays by which photons come.
    Later,
    /// Nobody answers here any more; a successor may.
    Never,
}

impl PreparedScene {
    /// Answers a batch that another member of the set asks: what rays meet of the part that is here, or
    /// which of its photons lie there.
    ///
    /// # Errors
    /// If the bytes are no batch.
    pub fn answer_batch(&self, batch: &[u8], packing: Packing) -> Result<Answered, WireError> {
        let questions = unpack(batch).and_then(|body| decode_questions(&body))?;
        if let Some(Question::Photons(_)) = questions.first() {
            return Ok(self.answer_for_photons(questions, packing));
        }
        let blame = &Blame::default();
        // A surface that lets rays pass is asked for it wherever there is one.
        Ok(Answered::Now(
            if self.needs.cutouts || self.needs.nested_media {
                let tracer = RayTracer::<true>::of_part(&self.geometry, &self.textures, blame);
                answer_all(questions, packing, |question| {
                    tracer.answer_of_part(question)
                })
            } else {
                let tracer = RayTracer::<false>::of_part(&self.geometry, &self.textures, blame);
                answer_all(questions, packing, |question| {
                    tracer.answer_of_part(question)
                })
            },
        ))
    }

    /// Waits until a batch that asks for photons can be answered.
    pub fn wait_for_photons(&self, batch: &[u8]) {
        let questions = unpack(batch).and_then(|body| decode_questions(&body));
        let Some(set) = &self.set else { return };
        for question in questions.unwrap_or_default() {
            if let Question::Photons(question) = question {
                set.photons.wait_for(question.pass);
            }
        }
    }

    fn answer_for_photons(&self, questions: Vec<Question>, packing: Packing) -> Answered {
        let member = self.set.as_ref().and_then(|set| Some((set, set.own?)));
        let Some((set, own)) = member else {
            return Answered::Never;
        };
        let mut missing = None;
        let answered = answer_all(questions, packing, |question| {
            let found = match &question {
                Question::Photons(question) => set.photons.look_up(own, question),
                _ => Found::Photons(question.answer_of_nobody()),
            };
            match found {
                Found::Photons(answer) => return answer,
                Found::Later => missing = Some(Answered::Later),
                Found::Closed => missing = Some(Answered::Never),
            }
            question.answer_of_nobody()
        });
        missing.unwrap_or(Answered::Now(answered))
    }
}
