//! Networks that part a worker from its console, one way or both.

mod chaos;
mod frame;

use std::time::Duration;

use chaos::{Direction, Passage, Proxy, Way};
use frame::Shot;
use frame::elsewhere::{next_ticket, open_options, serve, start_through, wait_until};
use kilauea_cluster::{ClusterOptions, ClusterResult};

/// Slow enough for a frame to take seconds: a result is 160 KB.
const SLOW: Way = Way {
    passage: Passage::Open,
    delay: Duration::ZERO,
    bytes_per_sec: Some(400e3),
    flip_at: None,
};

fn with(passage: Passage) -> Way {
    Way {
        passage,
        ..Way::default()
    }
}

/// A worker that is parted until it is taken for dead, and then heard again. Whether what it said
/// meanwhile comes too late or never.
fn check_parted(directions: &[Direction], passage: Passage) -> ClusterResult {
    let what = format!("{passage:?} {directions:?}");
    let shot = Shot::new();
    let job = shot.start(ClusterOptions {
        suspect_after: Duration::from_millis(700),
        dead_after: Duration::from_millis(1500),
        ..open_options(1)
    });
    let mut tickets = Vec::new();
    let ticket = next_ticket(&job, &mut tickets);
    let proxy = Proxy::new(&ticket.address);
    proxy.set(Direction::ToConsole, SLOW);
    let zombie = start_through(proxy.address(), ticket);
    wait_until(&job, "a result", |s| s.units.n_done > 0 || s.n_started > 1);
    for &direction in directions {
        proxy.set(direction, with(passage));
    }
    // It is dead now, and is to be started again.
    let ticket = next_ticket(&job, &mut tickets);
    assert_eq!((ticket.rank, ticket.incarnation), (0, 1), "{what}");
    proxy.set_both(&Way::default());
    if passage == Passage::Stalled {
        wait_until(&job, "late frames", |s| s.network.stale_messages > 0);
        let counts = job.snapshot().units;
        assert!(counts.n_held == 0, "{what}: the dead hold {counts:?}");
    }
    assert!(
        zombie.join().expect(&what).is_err(),
        "{what}: its console is gone"
    );
    // It joins again, over the same network; and once more if it seems dead on a busy machine.
    start_through(proxy.address(), ticket);
    serve(&job, |_, ticket| {
        start_through(proxy.address(), ticket);
    });
    let result = job.finish().expect(&what);
    shot.check(&shot.alone(), &result, &what);
    let reason = result.workers[0].lost.as_deref().unwrap_or_default();
    assert!(reason.contains("said nothing"), "{what}: {reason}");
    result
}

#[test]
fn what_waited_in_a_parted_network_comes_too_late() {
    for directions in [
        &[Direction::ToConsole, Direction::ToWorker][..],
        &[Direction::ToConsole][..],
    ] {
        let result = check_parted(directions, Passage::Stalled);
        assert!(result.network.stale_messages > 0);
    }
}

#[test]
fn what_a_network_lost_is_rendered_again() {
    check_parted(
        &[Direction::ToConsole, Direction::ToWorker],
        Passage::Blackhole,
    );
}

/// It is alive as far as the console can tell, and hears nothing: what was lent to it is late.
#[test]
fn a_worker_that_hears_nothing_does_not_hold_the_frame_up() {
    let shot = Shot::new();
    let job = shot.start(ClusterOptions {
        patience: Duration::from_millis(200),
        ..open_options(2)
    });
    let mut tickets = Vec::new();
    let deaf = next_ticket(&job, &mut tickets);
    let proxy = Proxy::new(&deaf.address);
    proxy.set(Direction::ToConsole, SLOW);
    start_through(proxy.address(), deaf);
    wait_until(&job, "a result", |s| s.units.n_done > 0);
    proxy.set(Direction::ToWorker, with(Passage::Stalled));
    let other = next_ticket(&job, &mut tickets);
    start_through(other.address.clone(), other);
    let result = job.finish().unwrap();
    shot.check(&shot.alone(), &result, "one hears nothing");
    assert_eq!(result.workers.len(), 2);
    assert!(result.workers.iter().all(|w| w.lost.is_none()));
    assert!(result.workers[1].units > 0);
}
