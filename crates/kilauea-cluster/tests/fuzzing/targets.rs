//! Everything that reads bytes of others, with inputs that it takes and bounds on what it allocates.

use std::io::Cursor;
use std::sync::Arc;

use kilauea_cluster::link::{Link, Traffic};
use kilauea_cluster::protocol::{
    Challenge, Chunk, Failed, Finish, Frame, FrameKind, HEADER_BYTES, Heartbeat, Hello, Lease,
    LeaseStart, Manifest, MemberAddress, Members, Message, PassesOver, PathsLeft, PathsLent,
    PathsWanted, Ready, Refused, Report, SceneBytes, Seat, Start, UnitDone, UnitDropped,
    UnitRefused,
};
use kilauea_cluster::{NetworkStats, Ticket, fuzzing, scene_from_bytes, scene_to_bytes};
use kilauea_render::{
    Broadcast, CollectedFrame, Packing, PathKind, PathPass, RenderStats, Tally, TileResult, Unit,
};

use super::seeds;

const SESSION: u64 = 7;
const MIB: usize = 1 << 20;

/// Reads bytes; an error in words.
type Read = Box<dyn FnMut(&[u8]) -> Result<(), String>>;

/// Something that reads bytes.
pub(crate) struct Target {
    pub(crate) name: &'static str,
    pub(crate) read: Read,
    /// Makes checksums and lengths fit what there is.
    pub(crate) repair: fn(Vec<u8>) -> Vec<u8>,
    /// Bytes that it takes.
    pub(crate) seeds: Vec<Vec<u8>>,
    /// What it may allocate whatever the input,
    pub(crate) fixed_bytes: usize,
    /// and for each byte of it.
    pub(crate) bytes_per_byte: usize,
}

/// All of them.
pub(crate) fn targets() -> Vec<Target> {
    vec![
        link(),
        messages(),
        scenes(),
        tile_sums(),
        journals(),
        tickets(),
        questions(),
        answers(),
        lookups(),
        found_photons(),
    ]
}

/// Bytes of a link: frames one after the other, until one is not as it should be.
fn link() -> Target {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .build()
        .expect("a runtime without drivers");
    let traffic = Arc::new(Traffic::default());
    let frames = all_messages();
    let seeds = [&frames[..1], &frames[3..5], &frames[7..10], &frames[..]].map(stream);
    Target {
        name: "link",
        read: Box::new(move |bytes| {
            let reader = Box::new(Cursor::new(bytes.to_vec()));
            let nowhere = Box::new(tokio::io::sink());
            let mut link = Link::new(reader, nowhere, SESSION, Arc::clone(&traffic));
            link.reader.expect_session(SESSION);
            loop {
                match runtime.block_on(link.reader.read()) {
                    Ok(frame) => read_message(&frame)?,
                    Err(kilauea_cluster::protocol::FrameError::Closed) => return Ok(()),
                    Err(error) => return Err(error.to_string()),
                }
            }
        }),
        repair: repair_frames,
        seeds: seeds.to_vec(),
        // A piece of a scene is the longest that a header may promise, and is given room at once.
        fixed_bytes: 68 * MIB,
        bytes_per_byte: 64,
    }
}

/// Bodies of frames: the first byte says of which kind.
fn messages() -> Target {
    let seed = |frame: &Frame| [&[frame.kind as u8][..], &frame.body].concat();
    Target {
        name: "messages",
        read: Box::new(|bytes| {
            let (&kind, body) = bytes.split_first().ok_or("empty")?;
            let kind = FrameKind::try_from(kind).map_err(|error| error.to_string())?;
            read_message(&Frame::new(kind, 0, body.to_vec()))
        }),
        repair: |mut bytes| {
            // The record takes all there is.
            if let Some(length) = bytes.len().checked_sub(5) {
                bytes[1..5].copy_from_slice(&(length as u32).to_le_bytes());
            }
            bytes
        },
        seeds: all_messages().iter().map(seed).collect(),
        // What the codec allows a record.
        fixed_bytes: 8 * MIB,
        bytes_per_byte: 64,
    }
}

/// Scenes, which are then checked as a worker checks them.
fn scenes() -> Target {
    Target {
        name: "scenes",
        read: Box::new(|bytes| {
            let scene = scene_from_bytes(bytes).map_err(|error| error.to_string())?;
            scene.validate().map_err(|error| error.to_string())
        }),
        repair: |bytes| bytes,
        seeds: vec![scene_to_bytes(&seeds::scene())],
        // Serde gives each list in a list up to a mebibyte at once, whatever length it promises.
        fixed_bytes: 16 * MIB,
        bytes_per_byte: 64,
    }
}

/// Sums of a tile that a worker says it has made.
fn tile_sums() -> Target {
    let settings = seeds::settings();
    let frame = || CollectedFrame::new(&settings).expect("the settings are sound");
    let seeds = vec![frame().sums(0), frame().sums(1)];
    let mut frame = frame();
    let n_passes = frame.n_passes();
    Target {
        name: "tile sums",
        read: Box::new(move |bytes| {
            // The passes do not matter here: they begin again where they are over.
            let done = frame.n_passes_done(0);
            if done == n_passes {
                frame = CollectedFrame::new(&settings).map_err(|error| error.to_string())?;
                return Ok(());
            }
            let unit = Unit {
                tile: 0,
                passes: done..n_passes,
            };
            let result = TileResult {
                unit,
                sums: bytes.to_vec(),
                tally: Tally::default(),
            };
            frame.put(result).map_err(|error| error.to_string())
        }),
        repair: |bytes| bytes,
        seeds,
        fixed_bytes: MIB,
        bytes_per_byte: 64,
    }
}

/// Journals, as a console opens them.
fn journals() -> Target {
    let settings = seeds::settings();
    let folder = std::env::temp_dir();
    let path = folder.join(format!("kilauea-fuzz-{}.journal", std::process::id()));
    let frame = CollectedFrame::new(&settings).expect("the settings are sound");
    let n_passes = frame.n_passes();
    let results = (0..frame.n_tiles()).map(|tile| {
        let passes = 0..n_passes;
        let unit = Unit { tile, passes };
        unit_done(unit).frame(0, &frame.sums(tile))
    });
    let frames: Vec<Frame> = std::iter::once(fuzzing::manifest().frame(0, &[]))
        .chain(results)
        .collect();
    let seed = stream_of(&frames, 0);
    Target {
        name: "journals",
        read: Box::new(move |bytes| {
            std::fs::write(&path, bytes).map_err(|error| error.to_string())?;
            let opened = fuzzing::open_journal(&path, &settings);
            // It may be gone already.
            let _ = std::fs::remove_file(&path);
            opened.map_err(|error| error.to_string())
        }),
        repair: repair_frames,
        seeds: vec![seed],
        fixed_bytes: 68 * MIB,
        bytes_per_byte: 64,
    }
}

/// Tickets, which are lines of JSON.
fn tickets() -> Target {
    let ticket = r#"{"address": "127.0.0.1:4000", "session": 7, "rank": 1, "incarnation": 0, "epoch": 2,
        "token": "0101010101010101010101010101010101010101010101010101010101010101",
        "identity": {"authority": [48, 1], "certificate": [48, 2], "key": [48, 3]}}"#;
    Target {
        name: "tickets",
        read: Box::new(|bytes| {
            let ticket: Ticket =
                serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
            drop(ticket);
            Ok(())
        }),
        repair: |bytes| bytes,
        seeds: vec![ticket.as_bytes().to_vec()],
        fixed_bytes: MIB,
        bytes_per_byte: 64,
    }
}

/// Rays that a member of a set is asked about: three rays, of which two are shadow rays.
fn questions() -> Target {
    between_members(
        "questions",
        question_bytes(),
        kilauea_render::fuzzing::read_questions,
    )
}

/// What a member answers to them.
fn answers() -> Target {
    between_members("answers", answer_bytes(), |bytes| {
        kilauea_render::fuzzing::read_answers(&question_bytes(), bytes)
    })
}

/// Look-ups of photons that members of a set ask of each other.
fn lookups() -> Target {
    between_members(
        "lookups",
        lookup_bytes(),
        kilauea_render::fuzzing::read_questions,
    )
}

/// The photons that a member finds for them.
fn found_photons() -> Target {
    Target {
        // As many as a reply may have, in columns and as they are, and what LZ4 may make of few bytes.
        fixed_bytes: 16 * MIB,
        ..between_members("found photons", found_bytes(), |bytes| {
            kilauea_render::fuzzing::read_answers(&lookup_bytes(), bytes)
        })
    }
}

/// A batch or its answers, which come packed or as they are.
fn between_members(
    name: &'static str,
    bytes: Vec<u8>,
    read: impl Fn(&[u8]) -> Result<(), String> + 'static,
) -> Target {
    Target {
        name,
        read: Box::new(read),
        repair: |bytes| bytes,
        seeds: vec![packed(&bytes), bytes],
        // The largest batch, and what LZ4 may make of few bytes.
        fixed_bytes: 8 * MIB,
        bytes_per_byte: 64,
    }
}

/// As docs/rays-on-the-wire.md has it, not packed: two look-ups.
fn lookup_bytes() -> Vec<u8> {
    let mut bytes = vec![0, 2, 0];
    bytes.extend([0, 2]);
    bytes.push(0);
    bytes.extend(3_u32.to_le_bytes());
    bytes.push(1);
    bytes.extend([1.0_f32, 2.0].map(f32::to_le_bytes).concat());
    for word in [0.5_f32, -1.0, 0.0, 1.0, 0.0, 0.0] {
        bytes.push(0);
        bytes.extend(word.to_le_bytes());
    }
    bytes
}

/// Both are answered: one photon, and some that are gone.
fn found_bytes() -> Vec<u8> {
    let mut bytes = vec![0, 2, 0];
    bytes.push(1);
    bytes.extend([1, u32::MAX].map(u32::to_le_bytes).concat());
    for word in [1.0_f32, 2.0, 3.0, 0.0, 1.0, 0.0, 0.25, 1e-4] {
        bytes.push(0);
        bytes.extend(word.to_le_bytes());
    }
    bytes
}

/// As docs/rays-on-the-wire.md has it, not packed.
fn question_bytes() -> Vec<u8> {
    let mut bytes = vec![0, 3, 0];
    // Kinds differ, visibility does not.
    bytes.extend([1, 0, 1, 1]);
    bytes.extend([0, 1]);
    for word in [0.0_f32, 1.0, 2.0, 0.0, -1.0, 0.0, 0.0, 1e30, 0.5] {
        bytes.push(0);
        bytes.extend(word.to_le_bytes());
    }
    // Keys differ: three words, plane by plane.
    bytes.push(1);
    bytes.extend([1, 2, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    // Two priorities.
    bytes.extend([0, 0]);
    bytes
}

/// A hit on a smooth triangle with a primvar, one ray that is occluded and one that is not.
fn answer_bytes() -> Vec<u8> {
    let mut bytes = vec![0, 0b011];
    for word in [
        1.5_f32.to_bits(),
        0.25_f32.to_bits(),
        0.5_f32.to_bits(),
        7,
        0,
    ] {
        bytes.push(0);
        bytes.extend(word.to_le_bytes());
    }
    bytes.push(1);
    bytes.extend((0..18).flat_map(|i| (i as f32).to_le_bytes()));
    bytes.extend([1, 0, 0x39]);
    bytes.extend((0..6).flat_map(|i| (i as f32).to_le_bytes()));
    bytes
}

/// The same, packed by LZ4.
fn packed(plain: &[u8]) -> Vec<u8> {
    let body = &plain[1..];
    let length = (body.len() as u32).to_le_bytes();
    [&[1], &length[..], &lz4_flex::compress(body)].concat()
}

fn unit_done(unit: Unit) -> UnitDone {
    let tally = Tally::default();
    UnitDone {
        lease: 3,
        unit,
        tally,
    }
}

/// A frame of each kind that holds a record.
fn all_messages() -> Vec<Frame> {
    let unit = || Unit {
        tile: 1,
        passes: 0..2,
    };
    let reason = || "why".to_owned();
    let hello = Hello {
        protocols: [1, 1],
        build_hash: 2,
        is_little_endian: true,
        scene_hash: Some([3; 32]),
        session: SESSION,
        rank: 0,
        incarnation: 0,
        epoch: 1,
        nonce: [4; 32],
        proof: [5; 32],
    };
    let start = Start {
        settings: seeds::settings(),
        specialize_rays: true,
        n_scene_bytes: 4,
        scene_hash: [3; 32],
        seat: Some(Seat {
            number: 1,
            n_outline_bytes: 2,
            n_chunks: 3,
            broadcast: Broadcast::Culled,
            packing: Packing::Lz4,
            photon_bytes: Some(1 << 20),
        }),
    };
    let members = Members {
        members: vec![MemberAddress {
            number: 1,
            epoch: 2,
            address: "127.0.0.1:9".into(),
        }],
    };
    let ready = Ready {
        n_threads: 2,
        address: Some("127.0.0.1:9".into()),
    };
    let chunk = Chunk {
        prototype: 0,
        number: 1,
    };
    let lease = Lease {
        id: 3,
        unit: unit(),
        start: LeaseStart::Sums,
    };
    let refused = UnitRefused {
        lease: 3,
        unit: unit(),
        reason: reason(),
    };
    let dropped = UnitDropped {
        lease: 3,
        unit: unit(),
    };
    let stats = RenderStats {
        warnings: vec![reason(), reason()],
        ..RenderStats::default()
    };
    let report = Report {
        stats,
        links: NetworkStats::default(),
    };
    let pass = PathPass {
        kind: PathKind::Photons,
        seed: 7,
        n_paths: 9,
    };
    let epoch = 1;
    vec![
        Challenge { nonce: [6; 32] }.frame(0, &[]),
        hello.frame(epoch, &[]),
        Refused { reason: reason() }.frame(0, &[]),
        Heartbeat { peak_rss: 1 << 20 }.frame(epoch, &[]),
        start.frame(epoch, &fuzzing::camera()),
        SceneBytes.frame(epoch, &[1, 2, 3, 4]),
        chunk.frame(epoch, &[1, 2, 3, 4]),
        ready.frame(epoch, &[]),
        members.frame(epoch, &[]),
        lease.frame(epoch, &[1; 64]),
        PassesOver { n_passes: 1 }.frame(epoch, &[]),
        PathsWanted { pass }.frame(epoch, &[]),
        PathsLent { pass, paths: 0..9 }.frame(epoch, &[]),
        PathsLeft { pass, paths: 0..9 }.frame(epoch, &[1, 2, 3]),
        unit_done(unit()).frame(epoch, &[1; 64]),
        refused.frame(epoch, &[]),
        dropped.frame(epoch, &[]),
        Finish.frame(epoch, &[]),
        report.frame(epoch, &[]),
        Failed { reason: reason() }.frame(epoch, &[]),
        fuzzing::manifest().frame(0, &[]),
    ]
}

/// Reads the record of a frame, whatever its kind.
fn read_message(frame: &Frame) -> Result<(), String> {
    fn read<M: Message>(frame: &Frame) -> Result<(), String> {
        M::read(frame)
            .map(|_| ())
            .map_err(|error| error.to_string())
    }
    match frame.kind {
        FrameKind::Challenge => read::<Challenge>(frame),
        FrameKind::Hello => read::<Hello>(frame),
        FrameKind::Refused => read::<Refused>(frame),
        FrameKind::Heartbeat => read::<Heartbeat>(frame),
        FrameKind::Start => {
            let (_, camera) = Start::read(frame).map_err(|error| error.to_string())?;
            fuzzing::read_camera(camera).map_err(|error| error.to_string())
        }
        FrameKind::SceneBytes => read::<SceneBytes>(frame),
        FrameKind::Chunk => read::<Chunk>(frame),
        FrameKind::Ready => read::<Ready>(frame),
        FrameKind::Members => read::<Members>(frame),
        FrameKind::Lease => read::<Lease>(frame),
        FrameKind::PassesOver => read::<PassesOver>(frame),
        FrameKind::PathsWanted => read::<PathsWanted>(frame),
        FrameKind::PathsLent => read::<PathsLent>(frame),
        FrameKind::PathsLeft => read::<PathsLeft>(frame),
        FrameKind::UnitDone => read::<UnitDone>(frame),
        FrameKind::UnitRefused => read::<UnitRefused>(frame),
        FrameKind::UnitDropped => read::<UnitDropped>(frame),
        FrameKind::Finish => read::<Finish>(frame),
        FrameKind::Report => read::<Report>(frame),
        FrameKind::Failed => read::<Failed>(frame),
        FrameKind::Manifest => read::<Manifest>(frame),
        // Rays and hits have no record: see the targets of their own.
        FrameKind::Rays | FrameKind::Hits => Ok(()),
    }
}

fn stream(frames: &[Frame]) -> Vec<u8> {
    stream_of(frames, SESSION)
}

fn stream_of(frames: &[Frame], session: u64) -> Vec<u8> {
    let frame = |(number, frame): (usize, &Frame)| {
        let header = frame.header(session, number as u16);
        [&header.expect("it is short")[..], &frame.body].concat()
    };
    frames.iter().enumerate().flat_map(frame).collect()
}

/// Makes checksums fit: of each frame as its header has it, as far as headers follow on each other.
fn repair_frames(mut bytes: Vec<u8>) -> Vec<u8> {
    let mut at = 0;
    while let Some(header) = bytes.get(at..at + HEADER_BYTES) {
        let length = [8, 9, 10, 11].map(|i| header[i]);
        let end = (at + HEADER_BYTES).saturating_add(u32::from_le_bytes(length) as usize);
        if end > bytes.len() {
            break;
        }
        bytes[at + 12..at + 16].fill(0);
        let checksum = crc32c::crc32c(&bytes[at..end]).to_le_bytes();
        bytes[at + 12..at + 16].copy_from_slice(&checksum);
        at = end;
    }
    bytes
}
