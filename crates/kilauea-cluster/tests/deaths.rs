//! Workers that die, hang or come back cost time and change no bit.

mod frame;

use std::time::Duration;

use frame::kills::{kill_one, n_kills};
use frame::{Shot, integrators, processes, signal, wait_for_progress};
use kilauea_cluster::{ClusterError, ClusterOptions};

#[test]
fn a_worker_killed_at_any_moment_changes_no_bit() {
    for (name, integrator, gi) in integrators() {
        let shot = Shot::new().with(|s| {
            s.samples_per_pixel = 16;
            s.integrator = integrator;
            s.gi = gi;
        });
        kill_and_check(&shot, name);
    }
}

#[test]
fn a_worker_killed_while_irradiance_is_found_changes_no_bit() {
    let shot = Shot::gathering().with(|s| s.samples_per_pixel = 16);
    kill_and_check(&shot, "final gathering");
}

/// Renders a frame again and again, with one of two workers killed each time.
fn kill_and_check(shot: &Shot, name: &str) {
    let alone = shot.alone();
    for seed in 0..n_kills() {
        let what = format!("{name}, seed {seed}");
        let job = shot.start(frame::options(2, processes()));
        kill_one(&job, seed);
        let result = job.finish().expect(&what);
        shot.check(&alone, &result, &what);
    }
}

#[test]
fn all_workers_killed_twice_are_replaced() {
    let shot = Shot::long();
    let alone = shot.alone();
    let job = shot.start(frame::options(2, processes()));
    for fraction in [0.1, 0.4] {
        wait_for_progress(&job, fraction);
        let killed = job.worker_pids();
        for &pid in &killed {
            signal("KILL", pid);
        }
        let is_killed = |pid: &u32| killed.contains(pid);
        while job.worker_pids().iter().any(is_killed) && !job.wait(Duration::from_millis(2)) {}
    }
    let result = job.finish().unwrap();
    shot.check(&alone, &result, "all killed twice");
    let lost = result.workers.iter().filter(|w| w.lost.is_some()).count();
    assert!(lost >= 2, "{:?}", result.workers);
    assert!(result.workers.iter().any(|w| w.incarnation > 0));
}

#[test]
fn a_worker_that_hangs_is_dead_after_two_seconds() {
    let shot = Shot::long();
    let alone = shot.alone();
    let job = shot.start(ClusterOptions::new(2, processes()));
    wait_for_progress(&job, 0.05);
    let pids = job.worker_pids();
    signal("STOP", pids[0]);
    let result = job.finish().unwrap();
    shot.check(&alone, &result, "one stopped");
    // Where the machine is busy, the other may seem to hang too.
    let mut lost = result.workers.iter().filter_map(|w| w.lost.as_deref());
    assert!(
        lost.any(|reason| reason.contains("said nothing")),
        "{:?}",
        result.workers
    );
}

#[test]
fn when_none_is_left_that_is_said() {
    let shot = Shot::long();
    let options = ClusterOptions {
        max_restarts: 0,
        ..frame::options(2, processes())
    };
    let job = shot.start(options);
    wait_for_progress(&job, 0.05);
    for pid in job.worker_pids() {
        signal("KILL", pid);
    }
    let error = job.finish().map(|_| ()).unwrap_err();
    assert!(
        matches!(error, ClusterError::NoWorkers { n_started: 2, .. }),
        "{error}"
    );
}
