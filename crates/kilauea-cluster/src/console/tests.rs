//! A console whose workers are the tests.

use std::time::Duration;

use kilauea_render::Tally;
use kilauea_scene::RenderSettings;
use kilauea_tests::Stage;
use tokio::sync::mpsc::{self, Receiver};

use super::*;
use crate::protocol::{Failed, Heartbeat, Ready, UnitDone, UnitDropped, UnitRefused};
use crate::snapshot::WorkerState;

/// A console of a frame of two tiles, which starts nobody, and one that it believes to be a worker
/// for each epoch of `epochs`.
fn console<const N: usize>(
    epochs: [u32; N],
    patience: Duration,
) -> (Console, [Receiver<Frame>; N]) {
    let settings = RenderSettings {
        resolution: [64, 32],
        samples_per_pixel: 1,
        ..Stage::settings()
    };
    let scene = Stage::sphere_on_floor().scene(settings.resolution);
    let options = ClusterOptions {
        max_restarts: 0,
        patience,
        ..ClusterOptions::new(N as u32, WorkerKind::Threads)
    };
    let mut console = Console::new(&scene, &settings, options).unwrap();
    console.n_started = N as u32;
    let outboxes = epochs.map(|epoch| {
        let (outbox, frames) = mpsc::channel(16);
        let rank = epoch - 1;
        let peer = Peer {
            holder: Holder { rank, epoch },
            stage: peer::Stage::Preparing(outbox),
            last_heard: Duration::ZERO,
            ready_at: Duration::ZERO,
            address: None,
            n_leases: 0,
            n_passes_over: 0,
            stats: WorkerStats {
                rank,
                ..WorkerStats::default()
            },
            process: None,
        };
        console.peers.insert(epoch, peer);
        say(
            &mut console,
            epoch,
            &Ready {
                n_threads: 1,
                address: None,
            },
            &[],
        );
        frames
    });
    (console, outboxes)
}

fn say(console: &mut Console, epoch: u32, message: &impl Message, bulk: &[u8]) {
    let frame = message.frame(epoch, bulk);
    console.handle(Event::Said { epoch, frame }).unwrap();
}

/// The units that a worker has been lent since it was last asked.
fn lent(frames: &mut Receiver<Frame>) -> Vec<Lease> {
    let frames = std::iter::from_fn(|| frames.try_recv().ok());
    let leases = frames.filter(|frame| frame.kind == Lease::KIND);
    leases.map(|frame| Lease::read(&frame).unwrap().0).collect()
}

/// What a worker says of a unit that came to `sums`.
fn done(lease: &Lease) -> UnitDone {
    UnitDone {
        lease: lease.id,
        unit: lease.unit.clone(),
        tally: Tally::default(),
    }
}

#[test]
fn one_who_computes_wrongly_is_an_alarm() {
    let (mut console, [mut first, mut second]) = console([1, 2], Duration::ZERO);
    console.lend().unwrap();
    let (ours, theirs) = (lent(&mut first), lent(&mut second));
    let same = |lease: &&Lease| lease.unit == ours[0].unit;
    let again = theirs
        .iter()
        .find(same)
        .expect("all is late, so lent twice");
    let right = console.frame.sums(ours[0].unit.tile);
    let mut wrong = right.clone();
    wrong[100] ^= 1;
    say(&mut console, 1, &done(&ours[0]), &right);
    assert!(console.alarms.is_empty());
    say(&mut console, 2, &done(again), &wrong);
    let [alarm] = &console.alarms[..] else {
        panic!("{:?}", console.alarms);
    };
    assert!(alarm.contains("worker 1 and worker 0"), "{alarm}");
    let taken = console.frame.sums(ours[0].unit.tile);
    assert_eq!(taken, right, "the first result counts");
    let stats = console.into_result().frame.stats;
    assert!(stats.warnings[0].contains("computes wrongly"));
}

#[test]
fn results_that_are_late_or_come_twice_do_not_count() {
    let (mut console, [mut first, mut second]) = console([1, 2], Duration::ZERO);
    console.lend().unwrap();
    let (ours, theirs) = (lent(&mut first), lent(&mut second));
    let sums = console.frame.sums(0);
    // The first is dead, and says something all the same.
    console.replace(1, "tests").unwrap();
    say(&mut console, 1, &done(&ours[0]), &sums);
    assert_eq!(console.frame.progress(), 0.0);
    // A frame that it sent in another life.
    let frame = done(&theirs[0]).frame(1, &sums);
    console.handle(Event::Said { epoch: 2, frame }).unwrap();
    assert_eq!(console.frame.progress(), 0.0);
    // A lease of someone else.
    say(&mut console, 2, &done(&ours[0]), &sums);
    assert_eq!(console.frame.progress(), 0.0);
    for _ in 0..2 {
        say(&mut console, 2, &done(&theirs[0]), &sums);
        assert_eq!(console.frame.progress(), 0.5);
    }
    say(&mut console, 2, &done(&theirs[1]), &sums);
    assert!(console.ledger.is_complete() && console.alarms.is_empty());
}

#[test]
fn workers_that_cannot_go_on_are_lost() {
    let (mut console, [mut first, mut second, _third]) = console([1, 2, 3], Duration::from_mins(1));
    console.lend().unwrap();
    let held = lent(&mut first);
    assert_eq!(held.len(), 2, "one for its thread, one that waits");
    assert!(lent(&mut second).is_empty());
    let Lease { id, unit, .. } = held[0].clone();
    let reason = "it is tired".to_owned();
    let lease = id;
    say(
        &mut console,
        1,
        &UnitRefused {
            lease,
            unit,
            reason,
        },
        &[],
    );
    assert!(!console.peers.contains_key(&1));
    assert_eq!(console.lost[0].lost.as_deref(), Some("it is tired"));
    console.lend().unwrap();
    let again = lent(&mut second);
    assert_eq!(again[0].unit, held[0].unit);
    // A result that is none.
    say(&mut console, 3, &PassesOver { n_passes: 1 }, &[]);
    assert!(!console.peers.contains_key(&3));
    // The last one.
    let error = console.replace(2, "tests").unwrap_err();
    assert!(
        matches!(error, ClusterError::NoWorkers { n_started: 3, .. }),
        "{error}"
    );
}

#[test]
fn dropped_units_are_told_of_and_lent_again() {
    let (mut console, [mut only]) = console([1], Duration::from_mins(1));
    console.lend().unwrap();
    let held = lent(&mut only);
    let Lease { id, unit, .. } = held[0].clone();
    let dropped = UnitDropped {
        lease: id,
        unit: unit.clone(),
    };
    say(&mut console, 1, &dropped, &[]);
    assert_eq!(console.snapshot().units.n_held, held.len() as u64 - 1);
    assert_eq!(console.snapshot().workers[0].stats.units_dropped, 1);
    console.lend().unwrap();
    let [again] = &lent(&mut only)[..] else {
        panic!("it is free again, and so is its worker");
    };
    assert_eq!(again.unit, unit);
    // Of a lease that has ended.
    say(&mut console, 1, &dropped, &[]);
    for lease in [again, &held[1]] {
        let sums = console.frame.sums(lease.unit.tile);
        say(&mut console, 1, &done(lease), &sums);
    }
    let stats = console.into_result().frame.stats;
    let [warning] = &stats.warnings[..] else {
        panic!("{:?}", stats.warnings);
    };
    assert!(
        warning.starts_with("worker 0 rendered 1 units"),
        "{warning}"
    );
}

#[test]
fn what_nobody_can_render_ends_the_frame() {
    let (mut console, _outboxes) = console([1], Duration::ZERO);
    let reason = "no such shader".to_owned();
    let frame = Failed { reason }.frame(1, &[]);
    let error = console.handle(Event::Said { epoch: 1, frame }).unwrap_err();
    assert_eq!(error.to_string(), "no such shader");
}

#[test]
fn silence_is_death_unless_the_console_slept_too() {
    let (mut console, [_first]) = console([1], Duration::from_mins(1));
    let two_seconds_ago = console
        .begun
        .checked_sub(Duration::from_millis(2100))
        .unwrap();
    console.begun = two_seconds_ago;
    console.tick().unwrap();
    assert!(console.peers.contains_key(&1), "nobody was there to hear");
    console.last_tick = console.now();
    console.with_silence(Duration::from_millis(2100));
    let error = console.tick().unwrap_err();
    assert!(error.to_string().contains("said nothing"), "{error}");
}

#[test]
fn suspects_get_no_units_until_they_speak() {
    let (mut console, [mut only]) = console([1], Duration::from_mins(1));
    let silence = Duration::from_millis(1500);
    console.begun = console.begun.checked_sub(silence).unwrap();
    console.lend().unwrap();
    assert!(lent(&mut only).is_empty());
    let state = |console: &Console| console.snapshot().workers[0].state;
    assert_eq!(state(&console), WorkerState::Suspect);
    assert_eq!(console.snapshot().laggards(), [0]);
    say(&mut console, 1, &Heartbeat { peak_rss: 5 }, &[]);
    console.lend().unwrap();
    assert_eq!(lent(&mut only).len(), 2);
    let snapshot = console.snapshot();
    assert_eq!(state(&console), WorkerState::Working);
    assert_eq!(snapshot.workers[0].stats.peak_rss, 5);
    assert_eq!((snapshot.units.n_units, snapshot.units.n_held), (2, 2));
}

impl Console {
    /// Makes it that all workers have said nothing for so long.
    fn with_silence(&mut self, silence: Duration) {
        let now = self.now();
        for peer in self.peers.values_mut() {
            peer.last_heard = now.saturating_sub(silence);
        }
    }
}

#[test]
fn of_reports_the_first_that_knows_all_is_taken() {
    let report = |rank, photon, full_passes| {
        let mut stats = RenderStats::default();
        (stats.rays.photon, stats.full_passes) = (photon, full_passes);
        (Holder { rank, epoch: rank }, stats)
    };
    // The first was still following photons when the frame was over.
    let reports = [report(0, 5, 10), report(1, 9, 11), report(2, 9, 12)];
    let taken = fullest(&reports).map(|stats| stats.full_passes);
    assert_eq!(taken, Some(11));
    assert!(fullest(&[]).is_none());
}
