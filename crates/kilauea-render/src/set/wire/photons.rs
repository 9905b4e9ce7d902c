//! A batch of look-ups of photons, and what a member finds.
//!
//! Questions: after their count and kind, as for rays, columns of the number of the pass, place, normal
//! and how many photons were told of already (a word each). Answers: how many questions are answered
//! (2 bytes), the first ones; a column of how many photons each found, all bits set where they are gone;
//! then columns of power, direction, density and squared distance of all photons. Where these are as many
//! as there may be, the last look-up may have found more.

use kilauea_math::Vec3;
use kilauea_photon::SurfaceQuery;
use kilauea_spot::{Wire, WireError};

use super::columns::Columns;
use super::{MAX_BATCH, Packing};
use crate::integrator::{Answer, ArrivingPhoton, N_WORDS, PhotonQuestion, Question};

/// Photons in a reply, at most: three quarters of what a body may be.
const MAX_PHOTONS: usize = 98_304;
/// In place of the number of photons that are gone.
const GONE: u32 = u32::MAX;

/// Writes look-ups.
pub(super) fn put_questions(questions: &[PhotonQuestion], columns: &Columns, bytes: &mut Vec<u8>) {
    let words: [fn(&PhotonQuestion) -> u32; 8] = [
        |q| q.pass,
        |q| q.at.p.x.to_bits(),
        |q| q.at.p.y.to_bits(),
        |q| q.at.p.z.to_bits(),
        |q| q.at.n.x.to_bits(),
        |q| q.at.n.y.to_bits(),
        |q| q.at.n.z.to_bits(),
        |q| q.n_told,
    ];
    for word in words {
        columns.put_words(questions.iter().map(word), bytes);
    }
}

/// Reads as many look-ups as `columns` has rows.
pub(super) fn take_questions(
    columns: &Columns,
    bytes: &mut &[u8],
) -> Result<Vec<Question>, WireError> {
    let mut words: [Vec<u32>; 8] = Default::default();
    for column in &mut words {
        *column = columns.take_words(bytes)?;
    }
    if !bytes.is_empty() {
        return Err(WireError::Long(bytes.len()));
    }
    let question = |i: usize| {
        let vec = |first: usize| {
            let [x, y, z] = [0, 1, 2].map(|axis| f32::from_bits(words[first + axis][i]));
            Vec3::new(x, y, z)
        };
        Question::Photons(PhotonQuestion {
            pass: words[0][i],
            at: SurfaceQuery {
                p: vec(1),
                n: vec(4),
            },
            n_told: words[7][i],
        })
    };
    Ok((0..words[0].len()).map(question).collect())
}

/// What look-ups found, as far as there is room for it.
#[derive(Default)]
pub(super) struct PhotonReplies {
    n_found: Vec<u32>,
    photons: Vec<ArrivingPhoton>,
}

impl PhotonReplies {
    /// Adds what a look-up found, as far as there is room for it; false where that is not all.
    pub(super) fn add(&mut self, found: Option<&[ArrivingPhoton]>) -> bool {
        let Some(found) = found else {
            self.n_found.push(GONE);
            return true;
        };
        let n = found.len().min(MAX_PHOTONS - self.photons.len());
        self.n_found.push(n as u32);
        self.photons.extend(&found[..n]);
        n == found.len()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.n_found.is_empty()
    }

    /// The bytes, which are to be packed.
    pub(super) fn encode(&self, packing: Packing) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(64 + 4 * self.n_found.len() + 36 * self.photons.len());
        (self.n_found.len() as u16).encode(&mut bytes);
        let columns = Columns::of(self.n_found.len()).packed_by(packing);
        columns.put_words(self.n_found.iter().copied(), &mut bytes);
        let columns = Columns::of(self.photons.len()).packed_by(packing);
        for word in 0..N_WORDS {
            let column = self
                .photons
                .iter()
                .map(|photon| photon.to_words()[word].to_bits());
            columns.put_words(column, &mut bytes);
        }
        bytes
    }
}

/// Whether the last look-up of a reply may have found more than there was room for.
pub(crate) fn may_be_cut(answers: &[Answer]) -> bool {
    let found = |answer: &Answer| match answer {
        Answer::Photons(Some(photons)) => photons.len(),
        _ => 0,
    };
    matches!(answers.last(), Some(Answer::Photons(Some(_))))
        && answers.iter().map(found).sum::<usize>() == MAX_PHOTONS
}

/// Reads the answers to the first of `n_asked` look-ups. Never panics, and takes no more memory than the
/// largest reply.
pub(super) fn decode_photons(n_asked: usize, mut bytes: &[u8]) -> Result<Vec<Answer>, WireError> {
    let bytes = &mut bytes;
    let n_answered = usize::from(u16::decode(bytes)?);
    let most = n_asked.min(MAX_BATCH);
    if n_answered > most {
        return Err(WireError::Long(n_answered - most));
    }
    if n_answered == 0 {
        return Err(WireError::Short);
    }
    let n_found = Columns::of(n_answered).take_words(bytes)?;
    let there = n_found.iter().filter(|&&n| n != GONE);
    let n_photons: u64 = there.map(|&n| u64::from(n)).sum();
    let n_photons = usize::try_from(n_photons)
        .ok()
        .filter(|&n| n <= MAX_PHOTONS);
    let n_photons = n_photons.ok_or(WireError::Long(MAX_PHOTONS))?;
    let columns = Columns::of(n_photons);
    let mut words: [Vec<u32>; N_WORDS] = Default::default();
    for column in &mut words {
        *column = columns.take_words(bytes)?;
    }
    if !bytes.is_empty() {
        return Err(WireError::Long(bytes.len()));
    }
    let photon = |i: usize| {
        ArrivingPhoton::of_words(std::array::from_fn(|word| f32::from_bits(words[word][i])))
    };
    let mut next = 0;
    let answers = n_found.iter().map(|&n| {
        if n == GONE {
            return Answer::Photons(None);
        }
        let first = next;
        next += n as usize;
        Answer::Photons(Some((first..next).map(photon).collect()))
    });
    Ok(answers.collect())
}
