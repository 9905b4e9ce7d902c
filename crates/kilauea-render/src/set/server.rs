//! A set in this process as the engine asks it: in batches, to one thread for each member.

use kilauea_accel::Visibility;
use kilauea_spot::{Parts, Program, RunError, WireError};

use super::ask::Asker;
use super::traffic::{RayKind, Traffic};
use super::wire::{
    Packing, decode_answers, decode_questions, encode_answers, encode_questions, pack, unpack,
};
use crate::integrator::{Answer, Blame, Question};

/// The members of a set, each with a thread of its own.
pub(crate) struct SetParts<'a, const CUTOUTS: bool> {
    pub(crate) asker: Asker<'a>,
    pub(crate) blame: &'a Blame,
    /// How questions and answers travel; as values if not as bytes.
    pub(crate) as_bytes: Option<Packing>,
    pub(crate) traffic: &'a Traffic,
}

impl Question {
    /// What the ray is for.
    fn ray_kind(&self) -> RayKind {
        match self {
            Self::Occluded { .. } => RayKind::Shadow,
            Self::Closest { ray, .. } if ray.visibility == Visibility::CAMERA => RayKind::Camera,
            // Nobody is asked for tiles.
            Self::Closest { .. } | Self::Tile(_) => RayKind::Indirect,
        }
    }
}

impl<P, const CUTOUTS: bool> Parts<P> for SetParts<'_, CUTOUTS>
where
    P: Program<Question = Question, Answer = Answer>,
{
    fn n_parts(&self) -> usize {
        self.asker.set.members.len()
    }

    fn whom(&self, question: &Question) -> u64 {
        let whom = self.asker.whom(question);
        if let Some(ray) = question.ray() {
            let kind = question.ray_kind();
            self.traffic.count_asked(kind, whom);
            if self.traffic.wants_sample(ray) {
                let units = self.asker.set.boxes.pierced_units(ray);
                self.traffic.add_sample(kind, units);
            }
        }
        whom.0
    }

    fn n_kinds(&self) -> usize {
        RayKind::ALL.len()
    }

    fn kind(&self, question: &Question) -> usize {
        question.ray_kind() as usize
    }

    fn of_nobody(&self, question: &Question) -> Answer {
        question.answer_of_nobody()
    }

    fn combine(&self, one: Answer, other: Answer) -> Answer {
        one.or(other)
    }

    fn answer(&self, part: usize, questions: Vec<Question>) -> Result<Vec<Answer>, RunError> {
        let Some(first) = questions.first() else {
            return Ok(Vec::new());
        };
        let kind = first.ray_kind();
        let member = &self.asker.set.members[part];
        let answer = |question| member.answer::<CUTOUTS>(question, self.blame);
        let answers: Vec<Answer> = match self.as_bytes {
            None => questions.into_iter().map(answer).collect(),
            Some(packing) => {
                let request = pack(&encode_questions(&questions), packing);
                let reply = answer_bytes(&request, packing, answer)?;
                self.traffic.count_bytes(kind, request.len(), reply.len());
                let body = unpack(&reply).map_err(|source| malformed(&reply, source))?;
                decode_answers(&questions, &body).map_err(|source| malformed(&reply, source))?
            }
        };
        let n_met = answers.iter().filter(|answer| answer.is_met()).count();
        self.traffic.count_met(kind, n_met);
        Ok(answers)
    }
}

/// The far side: it has nothing but bytes and what answers.
fn answer_bytes(
    request: &[u8],
    packing: Packing,
    answer: impl FnMut(Question) -> Answer,
) -> Result<Vec<u8>, RunError> {
    let questions = unpack(request).and_then(|body| decode_questions(&body));
    let questions = questions.map_err(|source| malformed(request, source))?;
    let answers: Vec<Answer> = questions.into_iter().map(answer).collect();
    Ok(pack(&encode_answers(&answers), packing))
}

fn malformed(bytes: &[u8], source: WireError) -> RunError {
    RunError::Malformed {
        n_bytes: bytes.len(),
        source,
    }
}
