//! The bytes of each message, as docs/protocol.md has them: a change of either needs the other, and
//! another protocol number where old and new programs could meet.

use std::fmt::Write;

use kilauea_cluster::NetworkStats;
use kilauea_cluster::protocol::{
    Challenge, Chunk, Failed, Finish, Frame, FrameKind, Heartbeat, Hello, Lease, LeaseStart,
    Manifest, MemberAddress, Members, Message, PassesOver, PathsLeft, PathsLent, PathsWanted,
    Ready, Refused, Report, SceneBytes, Seat, Start, UnitDone, UnitDropped, UnitRefused,
};
use kilauea_render::{Broadcast, Packing, PathKind, PathPass, RenderStats, Tally, Unit};
use kilauea_scene::RenderSettings;

const DOCUMENT: &str = include_str!("../../../docs/protocol.md");
const SESSION: u64 = 0x0102_0304_0506_0708;
const EPOCH: u32 = 9;
/// Longer frames are in the document by their hash.
const MAX_BYTES: usize = 112;

fn unit() -> Unit {
    Unit {
        tile: 3,
        passes: 1..4,
    }
}

fn path_pass() -> PathPass {
    PathPass {
        kind: PathKind::Arrivals,
        seed: 12,
        n_paths: 4096,
    }
}

/// One frame of each kind that has a record.
fn samples() -> Vec<Frame> {
    let reason = "why".to_owned();
    vec![
        Challenge { nonce: [1; 32] }.frame(0, &[]),
        Hello {
            protocols: [1, 1],
            build_hash: 2,
            is_little_endian: true,
            scene_hash: Some([3; 32]),
            session: SESSION,
            rank: 4,
            incarnation: 5,
            epoch: EPOCH,
            nonce: [6; 32],
            proof: [7; 32],
        }
        .frame(EPOCH, &[]),
        Refused {
            reason: reason.clone(),
        }
        .frame(0, &[]),
        Heartbeat { peak_rss: 1 << 20 }.frame(EPOCH, &[]),
        Start {
            settings: RenderSettings::default(),
            specialize_rays: true,
            n_scene_bytes: 10,
            scene_hash: [3; 32],
            seat: Some(Seat {
                number: 1,
                n_outline_bytes: 4,
                n_chunks: 5,
                broadcast: Broadcast::Culled,
                packing: Packing::Lz4,
                photon_bytes: Some(6),
            }),
        }
        .frame(EPOCH, &[]),
        SceneBytes.frame(EPOCH, &[1, 2, 3, 4]),
        Ready {
            n_threads: 8,
            address: Some("[::1]:7".to_owned()),
        }
        .frame(EPOCH, &[]),
        Lease {
            id: 11,
            unit: unit(),
            start: LeaseStart::Sums,
        }
        .frame(EPOCH, &[5, 6, 7, 8]),
        PassesOver { n_passes: 2 }.frame(EPOCH, &[]),
        UnitDone {
            lease: 11,
            unit: unit(),
            tally: Tally::default(),
        }
        .frame(EPOCH, &[5, 6, 7, 8]),
        UnitRefused {
            lease: 11,
            unit: unit(),
            reason: reason.clone(),
        }
        .frame(EPOCH, &[]),
        Finish.frame(EPOCH, &[]),
        Report {
            stats: RenderStats::default(),
            links: NetworkStats::default(),
        }
        .frame(EPOCH, &[]),
        Failed { reason }.frame(EPOCH, &[]),
        Manifest {
            build_hash: 2,
            scene_hash: [3; 32],
            settings_hash: [4; 32],
        }
        .frame(0, &[]),
        Members {
            members: vec![MemberAddress {
                number: 1,
                epoch: EPOCH,
                address: "[::1]:7".to_owned(),
            }],
        }
        .frame(EPOCH, &[]),
        Chunk {
            prototype: 2,
            number: 1,
        }
        .frame(EPOCH, &[1, 2, 3, 4]),
        PathsWanted { pass: path_pass() }.frame(EPOCH, &[]),
        PathsLent {
            pass: path_pass(),
            paths: 1024..2048,
        }
        .frame(EPOCH, &[]),
        PathsLeft {
            pass: path_pass(),
            paths: 1024..2048,
        }
        .frame(EPOCH, &[1, 2, 3, 4]),
        UnitDropped {
            lease: 11,
            unit: unit(),
        }
        .frame(EPOCH, &[]),
    ]
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// A frame in a line of the document.
fn line(frame: &Frame) -> String {
    let mut bytes = frame.header(SESSION, 1).expect("it is short").to_vec();
    bytes.extend(&frame.body);
    let kind = frame.kind;
    let n = bytes.len();
    if n <= MAX_BYTES {
        format!("{kind:?} {n} {}", hex(&bytes))
    } else {
        format!("{kind:?} {n} BLAKE3 {}", blake3::hash(&bytes).to_hex())
    }
}

#[test]
fn the_document_has_the_bytes_of_every_message() {
    let lines: Vec<String> = samples().iter().map(line).collect();
    let missing: Vec<&String> = lines
        .iter()
        .filter(|line| !DOCUMENT.contains(*line))
        .collect();
    assert!(
        missing.is_empty(),
        "docs/protocol.md should have\n{}",
        lines.join("\n")
    );
}

#[test]
fn the_document_names_every_kind_with_its_number_and_limit() {
    for &kind in FrameKind::ALL {
        let number = kind as u8;
        let limit = match kind.limit() {
            mib if mib % (1 << 20) == 0 => format!("{} MiB", mib >> 20),
            kib => format!("{} KiB", kib >> 10),
        };
        let row = format!("| {number} | `{kind:?}` | {limit} |");
        assert!(DOCUMENT.contains(&row), "docs/protocol.md has no row {row}");
    }
    let sampled = samples().len();
    let without_record = [FrameKind::Rays, FrameKind::Hits].len();
    assert_eq!(sampled + without_record, FrameKind::ALL.len());
}
