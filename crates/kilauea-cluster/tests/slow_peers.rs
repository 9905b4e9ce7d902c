//! Workers on slow links, and workers that come and go while a frame is rendered.

mod chaos;
mod frame;

use std::time::Duration;

use chaos::{Direction, Passage, Proxy, Way};
use frame::Shot;
use frame::elsewhere::{next_ticket, open_options, start_through, wait_until};
use kilauea_cluster::{ClusterOptions, Snapshot};

/// Frames that may wait for a worker that takes them: what it may hold, and some heartbeats.
const FEW_FRAMES: u64 = 16;

fn queue_of(snapshot: &Snapshot, rank: u32) -> u64 {
    let mut workers = snapshot.workers.iter();
    let worker = workers.find(|worker| worker.stats.rank == rank);
    worker.map_or(0, |worker| worker.n_frames_waiting)
}

#[test]
fn a_slow_link_holds_nobody_else_up() {
    let shot = Shot::new();
    let job = shot.start(ClusterOptions {
        patience: Duration::from_millis(200),
        ..open_options(2)
    });
    let mut tickets = Vec::new();
    let slow = next_ticket(&job, &mut tickets);
    let proxy = Proxy::new(&slow.address);
    // Eight seconds a result, and every message is late.
    let delay = Duration::from_millis(200);
    proxy.set_both(&Way {
        delay,
        ..Way::default()
    });
    proxy.set(
        Direction::ToConsole,
        Way {
            delay,
            bytes_per_sec: Some(20e3),
            ..Way::default()
        },
    );
    start_through(proxy.address(), slow);
    // The other begins once the slow one holds what it will not give back soon.
    wait_until(&job, "a lease", |s| s.units.n_held > 0);
    let fast = next_ticket(&job, &mut tickets);
    start_through(fast.address.clone(), fast);
    let mut longest_queue = 0;
    while !job.wait(Duration::from_millis(5)) {
        longest_queue = longest_queue.max(queue_of(&job.snapshot(), 1));
    }
    let last = job.snapshot();
    let result = job.finish().unwrap();
    shot.check(&shot.alone(), &result, "one on a slow link");
    assert!(longest_queue <= FEW_FRAMES, "{longest_queue} frames wait");
    let [slow, fast] = &result.workers[..] else {
        panic!("{:?}", result.workers);
    };
    assert!(fast.units > slow.units, "{:?}", result.workers);
    assert!(last.units.n_lent_again > 0, "{:?}", last.units);
}

#[test]
fn workers_come_and_go_while_a_frame_is_rendered() {
    let shot = Shot::new();
    let job = shot.start(open_options(1));
    let mut tickets = Vec::new();
    let first = next_ticket(&job, &mut tickets);
    let proxy = Proxy::new(&first.address);
    proxy.set(
        Direction::ToConsole,
        Way {
            bytes_per_sec: Some(400e3),
            ..Way::default()
        },
    );
    start_through(proxy.address(), first);
    wait_until(&job, "a result", |s| s.units.n_done > 0);
    // From here on the frame cannot end: the first holds units that nobody else is given.
    proxy.set_both(&Way {
        passage: Passage::Stalled,
        ..Way::default()
    });
    job.add_worker();
    let second = next_ticket(&job, &mut tickets);
    assert_eq!((second.rank, second.incarnation), (1, 0));
    start_through(second.address.clone(), second);
    wait_until(&job, "a result of the second", |s| {
        s.workers
            .iter()
            .any(|w| w.stats.rank == 1 && w.stats.units > 0)
    });
    proxy.cut();
    let result = job.finish().unwrap();
    shot.check(&shot.alone(), &result, "one came and one went");
    let lost: Vec<u32> = (result.workers.iter())
        .filter(|worker| worker.lost.is_some())
        .map(|worker| worker.rank)
        .collect();
    assert_eq!(lost, [0]);
}
