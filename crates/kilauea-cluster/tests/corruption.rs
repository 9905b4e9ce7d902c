//! What comes over a link is not what was sent, or comes more than once, or in another order.

mod chaos;
mod frame;

use std::mem::take;

use chaos::{Direction, Proxy, Rewrite, Way};
use frame::Shot;
use frame::elsewhere::{next_ticket, open_options, serve, start_through};
use kilauea_cluster::protocol::{Frame, FrameError, FrameKind};
use kilauea_cluster::{ClusterResult, Snapshot, WorkerError};

/// Has one worker at a time render behind a proxy, in which a byte of its first life is changed.
fn render_with_flip(
    shot: &Shot,
    direction: Direction,
    flip_at: u64,
) -> (ClusterResult, WorkerError) {
    let job = shot.start(open_options(1));
    let mut tickets = Vec::new();
    let first = next_ticket(&job, &mut tickets);
    let proxy = Proxy::new(&first.address);
    proxy.set(
        direction,
        Way {
            flip_at: Some(flip_at),
            ..Way::default()
        },
    );
    let worker = start_through(proxy.address(), first);
    serve(&job, |_, ticket| {
        start_through(proxy.address(), ticket);
    });
    let outcome = worker.join().expect("workers do not panic");
    let error = outcome.expect_err("its link is broken");
    (job.finish().expect("others render it"), error)
}

/// Whether an error of a link says what was wrong with a frame.
fn names_a_field(reason: &str) -> bool {
    [
        "magic", "protocol", "kind", "flags", "limit", "session", "number", "checksum",
    ]
    .iter()
    .any(|field| reason.contains(field))
}

#[test]
fn a_bit_that_flips_on_the_way_to_the_console_costs_a_worker_and_no_pixel() {
    let shot = Shot::new();
    let alone = shot.alone();
    // In what follows the handshake, in results, and in the header of one.
    for flip_at in [215, 2_000, 100_000, 200_000] {
        let what = format!("byte {flip_at} to the console");
        let (result, _) = render_with_flip(&shot, Direction::ToConsole, flip_at);
        shot.check(&alone, &result, &what);
        let reason = result.workers[0].lost.as_deref().expect(&what);
        assert!(names_a_field(reason), "{what}: {reason}");
    }
}

#[test]
fn a_bit_that_flips_on_the_way_to_a_worker_costs_it_and_no_pixel() {
    let shot = Shot::new();
    let alone = shot.alone();
    // In the settings, and in the scene.
    for flip_at in [300, 3_000, 8_000] {
        let what = format!("byte {flip_at} to the worker");
        let (result, error) = render_with_flip(&shot, Direction::ToWorker, flip_at);
        shot.check(&alone, &result, &what);
        assert!(result.workers[0].lost.is_some(), "{what}");
        assert!(
            matches!(&error, WorkerError::Frame(FrameError::Checksum(_))),
            "{what}: {error}"
        );
    }
}

/// Has a worker render whose frames are rewritten on their way.
fn render_rewritten(shot: &Shot, rewrite: Rewrite) -> (ClusterResult, Snapshot) {
    let job = shot.start(open_options(1));
    let ticket = next_ticket(&job, &mut Vec::new());
    let proxy = Proxy::rewriting(&ticket.address, rewrite);
    start_through(proxy.address(), ticket);
    serve(&job, |_, ticket| {
        panic!("{ticket:?} in place of a worker that is there")
    });
    let snapshot = job.snapshot();
    (job.finish().expect("all units come"), snapshot)
}

/// Fails where a unit counted twice or not at all, or a worker was accused.
fn check_once(shot: &Shot, (result, snapshot): &(ClusterResult, Snapshot), what: &str) {
    shot.check(&shot.alone(), result, what);
    assert_eq!(result.workers[0].units, snapshot.units.n_units, "{what}");
    let warnings = &result.frame.stats.warnings;
    assert!(
        !warnings.iter().any(|w| w.contains("wrongly")),
        "{warnings:?}"
    );
}

#[test]
fn results_that_come_twice_count_once() {
    let shot = Shot::new();
    let twice = |frame: Frame| match frame.kind {
        FrameKind::UnitDone => vec![frame.clone(), frame],
        _ => vec![frame],
    };
    let rendered = render_rewritten(&shot, Box::new(twice));
    check_once(&shot, &rendered, "each result twice");
}

#[test]
fn results_that_overtake_each_other_count_once() {
    let shot = Shot::new();
    let mut held: Vec<Frame> = Vec::new();
    let mut n_overtaken = 0;
    let (told, counted) = std::sync::mpsc::sync_channel(1 << 10);
    // A result waits until another frame has passed it.
    let later = move |frame: Frame| {
        let waited = take(&mut held);
        if frame.kind == FrameKind::UnitDone && waited.is_empty() {
            held.push(frame);
            return Vec::new();
        }
        n_overtaken += waited.len();
        // Nobody listens where the test has failed.
        let _ = told.try_send(n_overtaken);
        [vec![frame], waited].concat()
    };
    let rendered = render_rewritten(&shot, Box::new(later));
    check_once(&shot, &rendered, "results out of order");
    assert!(counted.try_iter().last() > Some(0));
}

#[test]
fn results_of_an_earlier_life_do_not_count() {
    let shot = Shot::new();
    let also_before = |frame: Frame| {
        let mut before = frame.clone();
        before.epoch = before.epoch.wrapping_sub(1);
        match frame.kind {
            FrameKind::UnitDone => vec![before, frame],
            _ => vec![frame],
        }
    };
    let rendered = render_rewritten(&shot, Box::new(also_before));
    check_once(&shot, &rendered, "each result in an earlier life too");
    let (result, snapshot) = &rendered;
    assert_eq!(result.network.stale_messages, snapshot.units.n_units);
}
