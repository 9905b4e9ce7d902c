//! A member's answers to a batch of questions.
//!
//! A bit for each question: whether anything was met. Of what was met, columns of distance,
//! parameters, primitive and placement (a word each), then the primitives one after the other. Of
//! what was not there is nothing more, nor of what is occluded.

use std::sync::Arc;

use kilauea_accel::Hit;
use kilauea_spot::WireError;

use super::Packing;
use super::columns::Columns;
use super::photons::{PhotonReplies, decode_photons};
use crate::integrator::{Answer, Met, Question};
use crate::set::parcel::{Parcel, Sealed};

/// The answers to a batch, written as they are found.
#[derive(Default)]
pub(crate) struct Replies {
    is_met: Vec<bool>,
    hits: Vec<Hit>,
    /// The primitives that were hit, one after the other.
    carried: Vec<u8>,
    /// The answers to look-ups of photons, which travel apart.
    photons: PhotonReplies,
}

impl Replies {
    /// Adds an answer; false where there is no room for all of it and for those that follow.
    pub(crate) fn add(&mut self, answer: &Answer) -> bool {
        if let Answer::Photons(found) = answer {
            return self.photons.add(found.as_deref());
        }
        self.is_met.push(answer.is_met());
        if let Answer::Met(met) = answer {
            self.hits.push(met.hit);
            met.parcel.encode(&mut self.carried);
        }
        true
    }

    /// The bytes, which are to be packed.
    pub(crate) fn encode(self, packing: Packing) -> Vec<u8> {
        if !self.photons.is_empty() {
            return self.photons.encode(packing);
        }
        let n_bytes = 64 + self.is_met.len() / 8 + 20 * self.hits.len() + self.carried.len();
        let mut bytes = Vec::with_capacity(n_bytes);
        Columns::of(self.is_met.len()).put_bits(self.is_met.into_iter(), &mut bytes);
        let columns = Columns::of(self.hits.len()).packed_by(packing);
        let words: [fn(&Hit) -> u32; 5] = [
            |hit| hit.t.to_bits(),
            |hit| hit.u.to_bits(),
            |hit| hit.v.to_bits(),
            |hit| hit.primitive,
            |hit| hit.instance,
        ];
        for word in words {
            columns.put_words(self.hits.iter().map(word), &mut bytes);
        }
        bytes.extend(self.carried);
        bytes
    }
}

/// Reads the answers to `questions`, but for the primitives, which are checked and stay where they are.
/// Never panics, and takes no more memory than there are questions and bytes for. Of look-ups of photons
/// only the first may be answered, and the last of these in part, as far as there was room.
pub(crate) fn decode_answers(
    questions: &[Question],
    answers: Vec<u8>,
) -> Result<Vec<Answer>, WireError> {
    if let Some(Question::Photons(_)) = questions.first() {
        return decode_photons(questions.len(), &answers);
    }
    let all = Arc::new(answers);
    let bytes = &mut all.as_slice();
    let is_met = Columns::of(questions.len()).take_bits(bytes)?;
    let is_closest = |q: &Question| matches!(q, Question::Closest { .. });
    let asked = questions.iter().zip(&is_met);
    let n_met = asked
        .filter(|(q, is_met)| **is_met && is_closest(q))
        .count();
    let columns = Columns::of(n_met);
    let mut words: [Vec<u32>; 5] = Default::default();
    for column in &mut words {
        *column = columns.take_words(bytes)?;
    }
    let mut next = 0;
    let mut begin = all.len() - bytes.len();
    let answers = questions.iter().zip(is_met).map(|(question, is_met)| {
        if !is_closest(question) {
            return Ok(Answer::Occluded(is_met));
        }
        if !is_met {
            return Ok(Answer::Closest(None));
        }
        let [t, u, v, primitive, instance] = [0, 1, 2, 3, 4].map(|column| words[column][next]);
        next += 1;
        let hit = Hit {
            t: f32::from_bits(t),
            u: f32::from_bits(u),
            v: f32::from_bits(v),
            primitive,
            instance,
        };
        let (sealed, end) = Sealed::at(&all, begin)?;
        begin = end;
        let parcel = Parcel::Sealed(sealed);
        Ok(Answer::Met(Met { hit, parcel }))
    });
    let answers = answers.collect::<Result<_, WireError>>()?;
    if begin == all.len() {
        Ok(answers)
    } else {
        Err(WireError::Long(all.len() - begin))
    }
}
