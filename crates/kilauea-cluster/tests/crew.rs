//! Workers that stay between frames and keep the scene.

mod frame;

use std::fs;
use std::thread::sleep;
use std::time::Duration;

use frame::{Shot, processes, signal};
use kilauea_cluster::{ClusterOptions, ClusterResult, Crew, scene_to_bytes};
use kilauea_math::{DMat4, DVec3};

fn render(shot: &Shot, crew: &Crew, change: impl FnOnce(&mut ClusterOptions)) -> ClusterResult {
    let mut options = ClusterOptions {
        crew: Some(crew.clone()),
        ..frame::options(2, processes())
    };
    change(&mut options);
    shot.start(options).finish().expect("the shot is sound")
}

fn pids(result: &ClusterResult) -> Vec<u32> {
    let mut pids: Vec<u32> = result.workers.iter().map(|worker| worker.pid).collect();
    pids.sort_unstable();
    pids
}

fn scene_bytes(shot: &Shot) -> u64 {
    scene_to_bytes(&shot.scene()).len() as u64
}

/// The same shot from another place, with a lens, and with other settings.
fn seen_from_elsewhere(shot: Shot) -> Shot {
    let mut shot = shot.with(|settings| {
        // One pass, so that no sums of tiles are sent either.
        settings.samples_per_pixel = 1;
        settings.seed = 7;
    });
    let camera = &mut shot.stage.camera;
    let aside = DMat4::from_translation(DVec3::new(0.2, 0.1, 0.0));
    camera.world_from_camera = aside * camera.world_from_camera;
    camera.lens_radius = 0.05;
    camera.focus_distance = 3.0;
    camera.exposure_scale = 2.0;
    shot
}

#[test]
fn workers_stay_and_the_scene_is_not_sent_again() {
    let crew = Crew::default();
    let first = Shot::new();
    let result = render(&first, &crew, |_| {});
    first.check(&first.alone(), &result, "the first frame");
    assert!(result.network.bytes_sent > 2 * scene_bytes(&first));
    assert_eq!(crew.n_idle(), 2);

    let second = seen_from_elsewhere(first);
    let again = render(&second, &crew, |_| {});
    second.check(&second.alone(), &again, "the same scene from elsewhere");
    assert_eq!(pids(&again), pids(&result));
    let sent = again.network.bytes_sent;
    assert!(sent < scene_bytes(&second), "{sent} bytes sent");
    assert_eq!(again.frame.stats.times.build, 0.0);
}

#[test]
fn another_scene_is_sent_and_other_ways_to_prepare_need_other_workers() {
    let crew = Crew::default();
    let first = Shot::new();
    let result = render(&first, &crew, |_| {});
    let mut other = Shot::new();
    other.stage.lights.pop();
    let again = render(&other, &crew, |_| {});
    other.check(&other.alone(), &again, "another scene");
    assert_eq!(pids(&again), pids(&result));
    assert!(again.network.bytes_sent > 2 * scene_bytes(&other));

    let general = render(&other, &crew, |options| options.specialize_rays = false);
    other.check(&other.alone(), &general, "prepared otherwise");
    assert!(
        pids(&general)
            .iter()
            .all(|pid| !pids(&result).contains(pid))
    );
    assert_eq!(crew.n_idle(), 2, "the others are not kept");
}

/// Whether a process of ours goes on. One that has ended is a zombie until its end is asked for.
fn is_running(pid: u32) -> bool {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    let state = stat
        .rsplit(") ")
        .next()
        .and_then(|rest| rest.chars().next());
    state.is_some_and(|state| state != 'Z')
}

#[test]
fn workers_that_die_between_frames_are_replaced() {
    let crew = Crew::default();
    let shot = Shot::new();
    let result = render(&shot, &crew, |_| {});
    let dead = pids(&result)[0];
    signal("KILL", dead);
    // The frame would be as right without.
    while is_running(dead) {
        sleep(Duration::from_millis(2));
    }
    let again = render(&shot, &crew, |_| {});
    shot.check(&shot.alone(), &again, "one died in between");
    let alive: Vec<_> = again.workers.iter().filter(|w| w.lost.is_none()).collect();
    assert!(alive.iter().all(|worker| worker.pid != dead), "{alive:?}");
    assert_eq!(alive.len(), 2);
}
