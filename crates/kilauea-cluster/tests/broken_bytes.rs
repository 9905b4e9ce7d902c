//! Bytes that are not what was sent: an error that says so, and no memory for what they promise.

use std::sync::Arc;

use kilauea_cluster::link::{Link, Traffic, channel};
use kilauea_cluster::protocol::{
    Expected, Frame, FrameError, FrameKind, HEADER_BYTES, Header, Lease, LeaseStart, Message,
    PROTOCOL, Refused,
};
use kilauea_math::hash::mix32;
use kilauea_render::Unit;
use tokio::io::AsyncWriteExt;

const SESSION: u64 = 0x1234_5678_9abc_def0;

fn lease() -> Frame {
    let unit = Unit {
        tile: 3,
        passes: 0..7,
    };
    let start = LeaseStart::Sums;
    Lease { id: 5, unit, start }.frame(9, &[1, 2, 3, 4, 5])
}

fn bytes_of(frame: &Frame) -> Vec<u8> {
    let mut bytes = frame.header(SESSION, 0).expect("it is short").to_vec();
    bytes.extend(&frame.body);
    bytes
}

/// What a reader makes of bytes, all of which come at once.
fn parse(bytes: &[u8]) -> Result<Frame, FrameError> {
    let expected = Expected {
        session: Some(SESSION),
        number: 0,
        max_body_bytes: u32::MAX,
    };
    let cut = || FrameError::Io(std::io::ErrorKind::UnexpectedEof.into());
    let (header, rest) = bytes.split_first_chunk::<HEADER_BYTES>().ok_or_else(cut)?;
    let header = Header::parse(header, &expected)?;
    let body = rest.get(..header.n_body_bytes()).ok_or_else(cut)?;
    header.with_body(body.to_vec())
}

#[test]
fn a_frame_comes_as_it_went() {
    let frame = lease();
    assert_eq!(parse(&bytes_of(&frame)).unwrap(), frame);
    let (read, bulk) = Lease::read(&frame).unwrap();
    assert_eq!(
        (read.id, read.unit.passes, bulk),
        (5, 0..7, &[1, 2, 3, 4, 5][..])
    );
    assert!(matches!(
        Refused::read(&frame),
        Err(FrameError::Unexpected { .. })
    ));
}

#[test]
fn every_bit_that_flips_is_noticed() {
    let sent = bytes_of(&lease());
    for bit in 0..8 * sent.len() {
        let mut bytes = sent.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(parse(&bytes).is_err(), "bit {bit}");
    }
    for length in 0..sent.len() {
        assert!(parse(&sent[..length]).is_err(), "{length} bytes");
    }
}

#[test]
fn each_field_has_an_error_of_its_own() {
    let with = |at: usize, value: &[u8]| {
        let mut bytes = bytes_of(&lease());
        bytes[at..at + value.len()].copy_from_slice(value);
        parse(&bytes).unwrap_err()
    };
    assert!(matches!(with(0, b"KIL2"), FrameError::Magic));
    let next = (PROTOCOL + 1).to_le_bytes();
    assert!(matches!(with(4, &next), FrameError::Protocol(found) if found == PROTOCOL + 1));
    assert!(matches!(with(6, &[0]), FrameError::Kind(0)));
    assert!(matches!(with(6, &[200]), FrameError::Kind(200)));
    assert!(matches!(with(7, &[0x80]), FrameError::Flags(0x80)));
    assert!(matches!(
        with(8, &[0xff; 4]),
        FrameError::TooLong {
            length: 0xffff_ffff,
            ..
        }
    ));
    assert!(matches!(
        with(12, &[0; 4]),
        FrameError::Checksum(FrameKind::Lease)
    ));
    assert!(matches!(with(16, &[0; 8]), FrameError::Session(0)));
    assert!(matches!(with(24, &[1]), FrameError::Checksum(_)));
    assert!(matches!(
        with(30, &[4, 0]),
        FrameError::Sequence {
            expected: 0,
            found: 4
        }
    ));
}

#[test]
fn no_kind_of_frame_may_be_longer_than_it_says() {
    for &kind in FrameKind::ALL {
        let mut bytes = Frame::new(kind, 0, Vec::new()).header(SESSION, 0).unwrap();
        bytes[8..12].copy_from_slice(&(kind.limit() + 1).to_le_bytes());
        let error = parse(&bytes).unwrap_err();
        assert!(
            matches!(error, FrameError::TooLong { .. }),
            "{kind:?}: {error}"
        );
        let too_long = Frame::new(kind, 0, vec![0; kind.limit() as usize + 1]);
        assert!(too_long.header(SESSION, 0).is_err(), "{kind:?} is sent");
    }
}

/// Records of random bytes: an error or a record, and never more memory than the limit of a frame.
#[test]
fn random_records_never_panic() {
    let mut state = 1_u32;
    let mut random = || {
        state = mix32(state.wrapping_add(0x9e37_79b9));
        state
    };
    let mut n_read = 0;
    for _ in 0..100_000 {
        let mut frame = lease();
        let n_changes = 1 + random() % 4;
        for _ in 0..n_changes {
            let at = random() as usize % frame.body.len();
            frame.body[at] = random() as u8;
        }
        if random() % 3 == 0 {
            frame
                .body
                .truncate(random() as usize % (frame.body.len() + 1));
        }
        n_read += u32::from(Lease::read(&frame).is_ok());
    }
    assert!(n_read > 0);
    // A text that promises four gigabytes.
    let mut refused = Refused { reason: "x".into() }.frame(0, &[]);
    refused.body[4..12].copy_from_slice(&u64::from(u32::MAX).to_le_bytes());
    assert!(matches!(
        Refused::read(&refused),
        Err(FrameError::Body { .. })
    ));
}

#[tokio::test]
async fn frames_that_are_missing_or_come_twice_are_noticed() {
    let traffic = Arc::new(Traffic::default());
    let first = bytes_of(&lease());
    let second = [&lease().header(SESSION, 1).unwrap()[..], &lease().body].concat();
    let third = [&lease().header(SESSION, 2).unwrap()[..], &lease().body].concat();
    for (bytes, n_good) in [
        ([&first[..], &second, &third].concat(), 3),
        ([&first[..], &third].concat(), 1),
        ([&first[..], &first].concat(), 1),
        ([&second[..], &first].concat(), 0),
    ] {
        let (ours, mut theirs) = channel();
        theirs.write_all(&bytes).await.unwrap();
        drop(theirs);
        let mut link = Link::over_channel(ours, SESSION, Arc::clone(&traffic));
        link.reader.expect_session(SESSION);
        for _ in 0..n_good {
            assert_eq!(link.reader.read().await.unwrap(), lease());
        }
        let error = link.reader.read().await.unwrap_err();
        let is_end = matches!(error, FrameError::Closed);
        assert_eq!(is_end, n_good == 3, "{error}");
    }
}
