//! A set as the engine asks it: in batches, on threads for each member.

use std::time::Instant;

use kilauea_accel::Visibility;
use kilauea_spot::{Parts, Program, Route, RunError, WireError};

use super::ask::{Asker, Begun};
use super::member::Member;
use super::partners::Asked;
use super::traffic::{RayKind, Traffic};
use super::wire::{
    Packing, Replies, decode_answers, decode_questions, encode_questions, may_be_cut, pack, unpack,
};
use crate::integrator::{Answer, Blame, Question};

/// The members of a set, each asked on threads of its own.
pub(crate) struct SetParts<'a, const CUTOUTS: bool> {
    pub(crate) asker: Asker<'a>,
    pub(crate) blame: &'a Blame,
    /// How questions and answers travel between members in this process; as values if not as bytes.
    pub(crate) as_bytes: Option<Packing>,
    pub(crate) traffic: &'a Traffic,
}

impl<'a, const CUTOUTS: bool> SetParts<'a, CUTOUTS> {
    /// Members in this process take values.
    pub(crate) fn by_values(asker: Asker<'a>, blame: &'a Blame, traffic: &'a Traffic) -> Self {
        Self {
            asker,
            blame,
            as_bytes: None,
            traffic,
        }
    }

    /// The answers of a member, and the bytes to and from it.
    fn ask(
        &self,
        number: usize,
        questions: Vec<Question>,
    ) -> Result<(Vec<Answer>, [usize; 2]), RunError> {
        let member = &self.asker.set.members[number];
        if let Member::Elsewhere(remote) = member {
            let start = Instant::now();
            let Asked { answers, n_bytes } = remote.ask(questions)?;
            self.traffic.count_batch(start.elapsed());
            return Ok((answers, n_bytes));
        }
        let tracer = member.tracer::<CUTOUTS>(self.blame);
        let answer = |question: Question| match (&tracer, &question) {
            (_, Question::Photons(question)) => self.asker.photons_of(number, question),
            (Some(tracer), _) => tracer.answer_of_part(question),
            (None, _) => question.answer_of_nobody(),
        };
        let Some(packing) = self.as_bytes else {
            return Ok((questions.into_iter().map(answer).collect(), [0; 2]));
        };
        let asked = ask_all(questions, packing, |request| {
            answer_bytes(&request, packing, answer).map_err(|error| malformed(&request, error))
        })?;
        Ok((asked.answers, asked.n_bytes))
    }
}

impl Question {
    /// What the ray is for.
    fn ray_kind(&self) -> RayKind {
        match self {
            Self::Occluded { .. } => RayKind::Shadow,
            Self::Closest { ray, .. } if ray.visibility == Visibility::CAMERA => RayKind::Camera,
            // Nobody is asked for tiles.
            Self::Closest { .. } | Self::Tile(_) => RayKind::Indirect,
            Self::Photons(_) => RayKind::Photons,
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

    fn route(&self, question: Question) -> Route<P> {
        if matches!(question, Question::Tile(_)) {
            return Route::Answered(question.answer_of_nobody());
        }
        let kind = question.ray_kind();
        if let Some(ray) = question.ray()
            && self.traffic.wants_sample(ray)
        {
            let units = self.asker.set.boxes.pierced_units(ray);
            self.traffic.add_sample(kind, units);
        }
        let Begun {
            known,
            question,
            whom,
        } = self.asker.begin::<CUTOUTS>(question, self.blame);
        self.traffic.count_ray(kind);
        if known.as_ref().is_some_and(Answer::is_met) {
            self.traffic.count_met(kind, 1);
        }
        match known {
            known if !whom.is_nobody() => Route::Asked {
                question,
                whom: whom.0,
                known,
            },
            Some(answer) => Route::Answered(answer),
            None => Route::Answered(question.answer_of_nobody()),
        }
    }

    fn n_kinds(&self) -> usize {
        RayKind::ALL.len()
    }

    fn kind(&self, question: &Question) -> usize {
        question.ray_kind() as usize
    }

    fn combine(&self, one: Answer, other: Answer) -> Answer {
        one.or(other)
    }

    fn n_batches_out(&self, part: usize) -> usize {
        match &self.asker.set.members[part] {
            Member::Elsewhere(remote) => remote.partners.n_batches_out(),
            Member::Beside(_) => 1,
            // Who asks knows what it has.
            Member::Own => 0,
        }
    }

    fn answer(&self, part: usize, questions: Vec<Question>) -> Result<Vec<Answer>, RunError> {
        let Some(first) = questions.first() else {
            return Ok(Vec::new());
        };
        let kind = first.ray_kind();
        self.traffic.count_asked(kind, part, questions.len());
        let (answers, n_bytes) = self.ask(part, questions)?;
        self.traffic.count_bytes(kind, n_bytes);
        let n_met = answers.iter().filter(|answer| answer.is_met()).count();
        self.traffic.count_met(kind, n_met);
        Ok(answers)
    }
}

/// Has all questions answered, as bytes: again and again where one reply has no room for all photons.
pub(super) fn ask_all(
    mut questions: Vec<Question>,
    packing: Packing,
    mut ask: impl FnMut(Vec<u8>) -> Result<Vec<u8>, RunError>,
) -> Result<Asked, RunError> {
    let mut all = Asked {
        answers: Vec::with_capacity(questions.len()),
        n_bytes: [0; 2],
    };
    // Of the first question that is left, as far as it was told.
    let mut told: Option<Answer> = None;
    while !questions.is_empty() {
        let request = pack(encode_questions(&questions, packing), packing);
        all.n_bytes[0] += request.len();
        let reply = ask(request)?;
        all.n_bytes[1] += reply.len();
        let answers = unpack(&reply).and_then(|body| decode_answers(&questions, body.into_owned()));
        let answers = answers.map_err(|source| malformed(&reply, source))?;
        let is_cut = may_be_cut(&answers);
        questions.drain(..answers.len() - usize::from(is_cut));
        let with_told = answers.into_iter().map(|answer| match told.take() {
            Some(told) => told.or(answer),
            None => answer,
        });
        all.answers.extend(with_told);
        if is_cut
            && let Some(Question::Photons(lookup)) = questions.first_mut()
            && let Some(Answer::Photons(Some(photons))) = all.answers.last()
        {
            lookup.n_told = photons.len() as u32;
            told = all.answers.pop();
        }
    }
    Ok(all)
}

/// The far side: it has nothing but bytes and what answers.
pub(super) fn answer_bytes(
    request: &[u8],
    packing: Packing,
    answer: impl FnMut(Question) -> Answer,
) -> Result<Vec<u8>, WireError> {
    let questions = unpack(request).and_then(|body| decode_questions(&body))?;
    Ok(answer_all(questions, packing, answer))
}

pub(super) fn answer_all(
    questions: Vec<Question>,
    packing: Packing,
    mut answer: impl FnMut(Question) -> Answer,
) -> Vec<u8> {
    let mut replies = Replies::default();
    for question in questions {
        if !replies.add(&answer(question)) {
            break;
        }
    }
    pack(replies.encode(packing), packing)
}

pub(super) fn malformed(bytes: &[u8], source: WireError) -> RunError {
    RunError::Malformed {
        n_bytes: bytes.len(),
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::{ArrivingPhoton, PhotonQuestion};
    use kilauea_math::Vec3;
    use kilauea_photon::SurfaceQuery;

    /// Photons that look-ups find: some fill replies to the last one, some take several, some are gone.
    const FOUND: [Option<u32>; 9] = [
        Some(3),
        Some(250_000),
        None,
        Some(0),
        Some(98_304),
        Some(0),
        None,
        Some(196_608),
        Some(1),
    ];

    fn lookup(i: u32) -> Question {
        let p = Vec3::new(i as f32, 0.0, 0.0);
        let at = SurfaceQuery { p, n: Vec3::Y };
        let (pass, n_told) = (0, 0);
        Question::Photons(PhotonQuestion { pass, at, n_told })
    }

    fn photons(question: Question) -> Answer {
        let Question::Photons(PhotonQuestion { at, n_told, .. }) = question else {
            panic!("{question:?}");
        };
        let i = at.p.x as usize;
        let photon = |n: u32| ArrivingPhoton::of_words([n as f32; 8].map(|n| n + i as f32));
        Answer::Photons(FOUND[i].map(|n| (n_told..n).map(photon).collect()))
    }

    #[test]
    fn what_one_reply_has_no_room_for_comes_in_parts() {
        let questions: Vec<Question> = (0..FOUND.len() as u32).map(lookup).collect();
        let expected: Vec<Answer> = questions.iter().copied().map(photons).collect();
        for packing in [Packing::Plain, Packing::Lz4] {
            let mut n_replies = 0;
            let asked = ask_all(questions.clone(), packing, |request| {
                n_replies += 1;
                answer_bytes(&request, packing, photons).map_err(|e| malformed(&request, e))
            });
            let asked = asked.expect("all are answered");
            assert!(asked.answers == expected, "{packing:?}");
            // 544,916 photons, and nothing but them where a reply is full.
            assert_eq!(n_replies, 6, "{packing:?}");
        }
    }
}
