//! A batch of questions.
//!
//! Count (2 bytes), then columns: kind and visibility (a byte each), origin, direction, range, time
//! and key (a word each), and the least priority (a byte) where there are shadow rays. A ray so
//! takes 24 bytes, and 4 more for each of range, time and key that it does not share with all.

use kilauea_accel::{Ray, Visibility};
use kilauea_math::Vec3;
use kilauea_spot::{Wire, WireError};

use super::columns::Columns;
use super::photons::{put_questions, take_questions};
use super::{MAX_BATCH, Packing};
use crate::integrator::{PhotonQuestion, Question};

const CLOSEST: u8 = 0;
const OCCLUDED: u8 = 1;
/// Look-ups of photons, which travel apart.
const PHOTONS: u8 = 2;

/// Writes a batch, of at most [`MAX_BATCH`] questions, to be packed.
pub(crate) fn encode_questions(questions: &[Question], packing: Packing) -> Vec<u8> {
    debug_assert!(questions.len() <= MAX_BATCH);
    let mut bytes = Vec::with_capacity(32 * questions.len() + 64);
    (questions.len() as u16).encode(&mut bytes);
    let columns = Columns::of(questions.len()).packed_by(packing);
    let kind = |q: &Question| match q {
        Question::Closest { .. } | Question::Tile(_) => CLOSEST,
        Question::Occluded { .. } => OCCLUDED,
        Question::Photons(_) => PHOTONS,
    };
    let kinds: Vec<u8> = questions.iter().map(kind).collect();
    columns.put_bytes(&kinds, &mut bytes);
    if kinds.first() == Some(&PHOTONS) {
        let lookups: Vec<PhotonQuestion> = questions.iter().filter_map(Question::lookup).collect();
        debug_assert!(lookups.len() == questions.len(), "look-ups travel apart");
        put_questions(&lookups, &columns, &mut bytes);
        return bytes;
    }
    let rays: Vec<&Ray> = questions.iter().filter_map(Question::ray).collect();
    debug_assert!(rays.len() == questions.len(), "none is asked for tiles");
    let visibility: Vec<u8> = rays.iter().map(|ray| ray.visibility.0).collect();
    columns.put_bytes(&visibility, &mut bytes);
    let words: [fn(&Ray) -> f32; 9] = [
        |ray| ray.origin.x,
        |ray| ray.origin.y,
        |ray| ray.origin.z,
        |ray| ray.dir.x,
        |ray| ray.dir.y,
        |ray| ray.dir.z,
        |ray| ray.t_min,
        |ray| ray.t_max,
        |ray| ray.time,
    ];
    for word in words {
        columns.put_words(rays.iter().map(|ray| word(ray).to_bits()), &mut bytes);
    }
    columns.put_words(questions.iter().map(Question::key), &mut bytes);
    let priorities = questions.iter().filter_map(|q| match q {
        Question::Closest { .. } | Question::Tile(_) | Question::Photons(_) => None,
        Question::Occluded { least_priority, .. } => Some(least_priority.cast_unsigned()),
    });
    let priorities: Vec<u8> = priorities.collect();
    Columns::of(priorities.len()).put_bytes(&priorities, &mut bytes);
    bytes
}

/// Reads what [`encode_questions`] wrote. Never panics, and takes no more memory than a batch of the
/// largest size.
pub(crate) fn decode_questions(mut bytes: &[u8]) -> Result<Vec<Question>, WireError> {
    let bytes = &mut bytes;
    let n = usize::from(u16::decode(bytes)?);
    if n > MAX_BATCH {
        return Err(WireError::Long(n - MAX_BATCH));
    }
    let columns = Columns::of(n);
    let kinds = columns.take_bytes(bytes)?;
    if kinds.first() == Some(&PHOTONS) {
        return match kinds.iter().find(|&&kind| kind != PHOTONS) {
            Some(&other) => Err(WireError::Variant(other)),
            None => take_questions(&columns, bytes),
        };
    }
    if let Some(&unknown) = kinds.iter().find(|&&kind| kind > OCCLUDED) {
        return Err(WireError::Variant(unknown));
    }
    let visibility = columns.take_bytes(bytes)?;
    let mut words: [Vec<u32>; 10] = Default::default();
    for column in &mut words {
        *column = columns.take_words(bytes)?;
    }
    let n_occluded = kinds.iter().map(|&kind| usize::from(kind)).sum();
    let mut priorities = Columns::of(n_occluded).take_bytes(bytes)?.into_iter();
    if !bytes.is_empty() {
        return Err(WireError::Long(bytes.len()));
    }
    let question = |i: usize| {
        let float = |column: usize| f32::from_bits(words[column][i]);
        let origin = Vec3::new(float(0), float(1), float(2));
        let dir = Vec3::new(float(3), float(4), float(5));
        let ray = Ray {
            t_min: float(6),
            t_max: float(7),
            time: float(8),
            visibility: Visibility(visibility[i]),
            ..Ray::new(origin, dir)
        };
        let key = words[9][i];
        if kinds[i] == CLOSEST {
            return Some(Question::Closest { ray, key });
        }
        Some(Question::Occluded {
            ray,
            key,
            least_priority: priorities.next()?.cast_signed(),
        })
    };
    (0..n)
        .map(question)
        .collect::<Option<_>>()
        .ok_or(WireError::Short)
}
