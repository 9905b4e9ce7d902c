use kilauea_accel::{Hit, Ray, Visibility};
use kilauea_math::Vec3;
use kilauea_math::hash::combine;
use kilauea_photon::SurfaceQuery;
use kilauea_scene::{Attribute, Interpolation};
use kilauea_spot::WireError;

use super::*;
use crate::geometry::{Ball, Carried, Shape, Triangle};
use crate::integrator::{Answer, ArrivingPhoton, Met, PhotonQuestion, Question};
use crate::set::Parcel;

/// Number `i` of a batch of shadow rays from one point, or of closest hits from different ones.
fn question(i: u32, is_shadow: bool) -> Question {
    let x = i as f32;
    let ray = Ray::new(Vec3::new(0.5, -2.0, 1e-3), Vec3::new(x, 1.0 - x, 0.25));
    if is_shadow {
        Question::Occluded {
            ray: Ray {
                t_max: 0.9999,
                visibility: Visibility::SHADOW,
                ..ray
            },
            key: 0,
            least_priority: i8::MIN,
        }
    } else {
        Question::Closest {
            ray: Ray {
                origin: Vec3::new(x, 2.0 * x, -x),
                time: 0.125 * x,
                visibility: Visibility::INDIRECT,
                ..ray
            },
            key: combine(i, 5),
        }
    }
}

fn batch(n: u32, is_shadow: impl Fn(u32) -> bool) -> Vec<Question> {
    (0..n).map(|i| question(i, is_shadow(i))).collect()
}

fn met(i: u32) -> Answer {
    let corners = [Vec3::splat(i as f32), Vec3::X, Vec3::Y];
    let shape = if i % 5 == 4 {
        Shape::Ball(Ball {
            center: Vec3::Z,
            radius: 0.5,
        })
    } else {
        Shape::Triangle(Triangle {
            corners,
            normals: i.is_multiple_of(2).then_some(corners),
        })
    };
    let st = Attribute {
        name: String::new(),
        width: 2,
        interpolation: Interpolation::Vertex,
        data: vec![0.25; 6],
    };
    Answer::Met(Met {
        hit: Hit {
            t: 1.5 + i as f32,
            u: 0.25,
            v: 0.5,
            primitive: i,
            instance: 7,
        },
        parcel: Parcel::Open(Box::new(Carried {
            shape,
            attributes: vec![st; (i % 3) as usize],
        })),
    })
}

/// Number `i` of a batch of look-ups.
fn lookup(i: u32) -> Question {
    Question::Photons(PhotonQuestion {
        pass: 3,
        at: SurfaceQuery {
            p: Vec3::new(i as f32, 0.5, -1.0),
            n: Vec3::Y,
        },
        n_told: i % 2,
    })
}

fn photon(i: u32) -> ArrivingPhoton {
    ArrivingPhoton::of_words(std::array::from_fn(|word| (i * 8) as f32 + word as f32))
}

/// Answers of all kinds to a batch.
fn answers(questions: &[Question]) -> Vec<Answer> {
    let numbered = (0..).zip(questions);
    numbered
        .map(|(i, question): (u32, _)| match question {
            Question::Occluded { .. } => Answer::Occluded(i.is_multiple_of(3)),
            Question::Tile(_) => panic!("none is asked for tiles"),
            Question::Photons(_) if i.is_multiple_of(5) => Answer::Photons(None),
            Question::Photons(_) => Answer::Photons(Some((0..i % 4).map(photon).collect())),
            Question::Closest { .. } if i.is_multiple_of(4) => Answer::Closest(None),
            Question::Closest { .. } => met(i),
        })
        .collect()
}

/// Answers as bytes.
fn encode_answers(answers: &[Answer], packing: Packing) -> Vec<u8> {
    let mut replies = Replies::default();
    for answer in answers {
        replies.add(answer);
    }
    replies.encode(packing)
}

#[test]
fn batches_survive() {
    for n in [0, 1, 9, 1024] {
        let kinds: [fn(u32) -> bool; 3] = [|_| false, |_| true, |i| i.is_multiple_of(2)];
        for is_shadow in kinds {
            let questions = batch(n, is_shadow);
            let answers = answers(&questions);
            for packing in [Packing::Plain, Packing::Lz4] {
                let bytes = encode_questions(&questions, packing);
                assert_eq!(decode_questions(&bytes).as_ref(), Ok(&questions));
                let reply = encode_answers(&answers, packing);
                assert_eq!(
                    decode_answers(&questions, reply.clone()).as_ref(),
                    Ok(&answers)
                );
                assert_eq!(
                    unpack(&pack(reply.clone(), packing)).as_deref(),
                    Ok(&reply[..])
                );
            }
        }
    }
}

#[test]
fn lookups_of_photons_survive() {
    for n in [1, 9, 1024] {
        let questions: Vec<Question> = (0..n).map(lookup).collect();
        let answers = answers(&questions);
        for packing in [Packing::Plain, Packing::Lz4] {
            let bytes = encode_questions(&questions, packing);
            assert_eq!(decode_questions(&bytes).as_ref(), Ok(&questions));
            let reply = encode_answers(&answers, packing);
            assert_eq!(decode_answers(&questions, reply).as_ref(), Ok(&answers));
        }
    }
    let mixed = [lookup(0), question(1, true)];
    assert_eq!(
        decode_questions(&kinds_of(&mixed)),
        Err(WireError::Variant(1))
    );
}

/// The beginning of a batch of questions.
fn kinds_of(questions: &[Question]) -> Vec<u8> {
    let kind = |q: &Question| match q {
        Question::Photons(_) => 2,
        _ => 1,
    };
    let n = (questions.len() as u16).to_le_bytes();
    let kinds: Vec<u8> = questions.iter().map(kind).collect();
    [&n[..], &[1], &kinds].concat()
}

#[test]
fn a_reply_has_the_photons_that_there_is_room_for() {
    let questions: Vec<Question> = (0..3).map(lookup).collect();
    let found = |n: u32| Answer::Photons(Some((0..n).map(photon).collect()));
    let mut replies = Replies::default();
    assert!(replies.add(&found(60_000)));
    assert!(!replies.add(&found(60_000)), "there is room for a part");
    let reply = replies.encode(Packing::Plain);
    assert!(pack(reply.clone(), Packing::Plain).len() < 4 << 20);
    let expected = vec![found(60_000), found(98_304 - 60_000)];
    assert!(may_be_cut(&expected) && !may_be_cut(&expected[..1]));
    assert_eq!(decode_answers(&questions, reply), Ok(expected));
}

#[test]
fn a_ray_takes_no_more_than_what_is_its_own() {
    let size = |questions: &[Question]| {
        let more = encode_questions(&batch(2, |_| true), Packing::Plain).len();
        (encode_questions(questions, Packing::Plain).len() - more) as f64
            / (questions.len() - 2) as f64
    };
    // From one point at one time: two components of a direction that differ.
    let shadow = batch(1002, |_| true);
    assert!((size(&shadow) - 8.0).abs() < 0.01, "{}", size(&shadow));
    // Origin, two components of a direction, time and key.
    let scattered = batch(1002, |_| false);
    let bytes = size(&scattered);
    assert!((bytes - 28.0).abs() < 0.1, "{bytes}");
    // An answer to a shadow ray is a bit.
    assert_eq!(
        encode_answers(&answers(&shadow), Packing::Plain).len(),
        1002_usize.div_ceil(8)
    );
}

/// The bytes of a small batch and of the answers to it, as `docs/rays-on-the-wire.md` has them.
#[test]
fn golden_bytes() {
    let questions = batch(2, |_| true);
    let expected: &[u8] = &[
        2, 0, // questions
        0, 1, // kind: all are shadow rays
        0, 2, // visibility
        0, 0, 0, 0, 0x3f, // origin: all from 0.5,
        0, 0, 0, 0, 0xc0, // -2,
        0, 0x6f, 0x12, 0x83, 0x3a, // 0.001
        1, 0, 0, 0, 0, 0, 0, 0x80, 0x3f, // direction: 0 and 1,
        1, 0, 0, 0x80, 0x3f, 0, 0, 0, 0, // 1 and 0,
        0, 0, 0, 0x80, 0x3e, // 0.25
        0, 0, 0, 0, 0, // range: from 0
        0, 0x72, 0xf9, 0x7f, 0x3f, // to 0.9999
        0, 0, 0, 0, 0, // time
        0, 0, 0, 0, 0, // key
        0, 0x80, // least priority
    ];
    assert_eq!(encode_questions(&questions, Packing::Plain), expected);
    assert_eq!(encode_answers(&answers(&questions), Packing::Plain), [1]);

    let questions = batch(2, |_| false);
    let expected: &[u8] = &[
        2, // the second has met something
        0, 0, 0, 0x20, 0x40, // distance 2.5
        0, 0, 0, 0x80, 0x3e, // parameters 0.25
        0, 0, 0, 0, 0x3f, // and 0.5
        0, 1, 0, 0, 0, // primitive
        0, 7, 0, 0, 0, // placement
        0, // a faceted triangle: its corners
        0, 0, 0x80, 0x3f, 0, 0, 0x80, 0x3f, 0, 0, 0x80, 0x3f, // (1, 1, 1)
        0, 0, 0x80, 0x3f, 0, 0, 0, 0, 0, 0, 0, 0, // (1, 0, 0)
        0, 0, 0, 0, 0, 0, 0x80, 0x3f, 0, 0, 0, 0, // (0, 1, 0)
        1, 0,    // primvars
        0x39, // three values of two floats, one for each vertex
        0, 0, 0x80, 0x3e, 0, 0, 0x80, 0x3e, 0, 0, 0x80, 0x3e, 0, 0, 0x80, 0x3e, 0, 0, 0x80, 0x3e,
        0, 0, 0x80, 0x3e,
    ];
    assert_eq!(
        encode_answers(&answers(&questions), Packing::Plain),
        expected
    );
}

#[test]
fn too_many_questions_are_refused() {
    let n = MAX_BATCH as u16 + 1;
    let bytes = n.to_le_bytes();
    assert_eq!(decode_questions(&bytes), Err(WireError::Long(1)));
    let mut long = encode_questions(&batch(3, |_| true), Packing::Plain);
    long.push(0);
    assert_eq!(decode_questions(&long), Err(WireError::Long(1)));
}

#[test]
fn packed_bytes_promise_no_more_than_they_hold() {
    let promise = |n: u32| [&[1][..], &n.to_le_bytes(), &[0x10, 7]].concat();
    assert!(matches!(
        unpack(&promise(u32::MAX)),
        Err(WireError::Long(_))
    ));
    assert_eq!(unpack(&promise(1000)), Err(WireError::Packed));
    assert_eq!(unpack(&[2, 0, 0]), Err(WireError::Variant(2)));
    assert_eq!(unpack(&[]), Err(WireError::Short));
}

/// Bytes that are cut, flipped or made up are refused or read as something; nothing panics.
#[test]
fn bad_bytes_do_no_harm() {
    damage_all(&batch(40, |i| i.is_multiple_of(3)));
    damage_all(&(0..40).map(lookup).collect::<Vec<_>>());
}

fn damage_all(questions: &[Question]) {
    let request = encode_questions(questions, Packing::Plain);
    let reply = encode_answers(&answers(questions), Packing::Lz4);
    let packed = pack(reply.clone(), Packing::Lz4);
    for end in 0..request.len() {
        assert!(decode_questions(&request[..end]).is_err(), "{end}");
    }
    for end in 0..reply.len() {
        assert!(
            decode_answers(questions, reply[..end].to_vec()).is_err(),
            "{end}"
        );
    }
    let mut n_refused = 0;
    for seed in 0..20_000 {
        let random = |i: u32, n: usize| combine(seed, i) as usize % n;
        let damage = |bytes: &[u8]| {
            let mut bytes = bytes.to_vec();
            for i in 0..=random(0, 4) as u32 {
                let at = random(2 * i + 1, bytes.len());
                bytes[at] = combine(seed, 2 * i + 2) as u8;
            }
            bytes
        };
        n_refused += usize::from(decode_questions(&damage(&request)).is_err());
        n_refused += usize::from(decode_answers(questions, damage(&reply)).is_err());
        if let Ok(body) = unpack(&damage(&packed)) {
            n_refused += usize::from(decode_answers(questions, body.into_owned()).is_err());
        }
    }
    assert!(n_refused > 1000, "{n_refused}");
}
