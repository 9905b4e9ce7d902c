//! A scene spread over sets of workers renders as one process renders it, whoever dies.

mod frame;

use frame::kills::{kill_one, n_kills};
use frame::{Shot, integrators, processes, signal, wait_for_progress};
use kilauea_cluster::{
    ClusterError, ClusterJob, ClusterOptions, ClusterResult, SetOptions, SetSize, WorkerKind,
};
use kilauea_render::{Broadcast, Packing, PhotonDemand, PhotonRoom, SetPlan};
use kilauea_scene::{GlobalIllumination, Integrator, PhotonSplit, Shading};

const CULLED: SetOptions = SetOptions {
    size: SetSize::Workers(2),
    broadcast: Broadcast::Culled,
    packing: Packing::Plain,
};

/// So many workers in sets of `size`.
fn options(n_workers: u32, size: u32, kind: WorkerKind) -> ClusterOptions {
    ClusterOptions {
        set: Some(SetOptions {
            size: SetSize::Workers(size),
            ..CULLED
        }),
        ..frame::options(n_workers, kind)
    }
}

/// Fails where a set did not do what sets do.
fn check_set(result: &ClusterResult, size: usize, what: &str) {
    let set = result.frame.stats.set.as_ref().expect(what);
    assert_eq!(set.members.len(), size, "{what}");
    for (number, member) in set.members.iter().enumerate() {
        assert!(member.bytes.scene > 0, "{what}: {number} holds nothing");
        assert!(member.asked > 0, "{what}: {number} was not asked");
    }
    let n_asked: u64 = set.rays.iter().map(|rays| rays.asked).sum();
    let n_rays: u64 = set.rays.iter().map(|rays| rays.rays).sum();
    assert!(n_rays > 0 && n_asked > 0, "{what}: {set:?}");
    assert!(set.batches > 0 && set.seconds_under_way > 0.0, "{what}");
    for worker in &result.workers {
        let seat = worker.seat.expect(what);
        assert_eq!(seat.set * size as u32 + seat.member, worker.rank, "{what}");
    }
}

/// A shot in which some paths train, however few there are, where that is what the integrator does.
fn shot_of(integrator: Integrator, gi: GlobalIllumination) -> Shot {
    Shot::new().with(|s| {
        s.integrator = integrator;
        s.gi = gi;
        if integrator == Integrator::Kilauea {
            s.general = vec!["guided_directions".into()];
        }
    })
}

/// With some of the integrators, sets of two and of three.
fn check(
    n_integrators: usize,
    kind: &WorkerKind,
    tls: bool,
    broadcast: Broadcast,
    packing: Packing,
) {
    for (name, integrator, gi) in integrators().into_iter().take(n_integrators) {
        let shot = shot_of(integrator, gi);
        let alone = shot.alone();
        for size in [2, 3] {
            let what = format!("{name}, a set of {size}, {broadcast:?}, TLS {tls}");
            let options = ClusterOptions {
                tls,
                set: Some(SetOptions {
                    size: SetSize::Workers(size),
                    broadcast,
                    packing,
                }),
                ..frame::options(size, kind.clone())
            };
            let result = shot.start(options).finish().expect(&what);
            shot.check(&alone, &result, &what);
            check_set(&result, size as usize, &what);
            let (ours, theirs) = (&alone.stats.gather, &result.frame.stats.gather);
            assert_eq!(ours, theirs, "{what}");
            assert_eq!(ours.paths > 0, name == "kilauea", "{what}");
            assert!(result.workers.iter().all(|w| w.lost.is_none()), "{what}");
        }
    }
}

#[test]
fn over_tcp_to_those_that_may_meet_a_ray() {
    check(3, &processes(), false, Broadcast::Culled, Packing::Plain);
}

#[test]
fn over_tcp_to_all() {
    check(2, &processes(), false, Broadcast::Full, Packing::Lz4);
}

#[test]
fn over_tls_to_those_that_may_meet_a_ray() {
    check(2, &processes(), true, Broadcast::Culled, Packing::Lz4);
}

#[test]
fn over_tls_to_all() {
    let packing = Packing::Plain;
    check(2, &WorkerKind::Threads, true, Broadcast::Full, packing);
}

#[test]
fn where_paths_look_irradiance_up() {
    let shot = Shot::gathering();
    let alone = shot.alone();
    for (n_workers, size, kind) in [(3, 3, WorkerKind::Threads), (4, 2, processes())] {
        let what = format!("final gathering, {n_workers} workers in sets of {size}");
        let result = shot.start(options(n_workers, size, kind)).finish();
        let result = result.expect(&what);
        shot.check_gathering(&alone, &result, &what);
        check_set(&result, size as usize, &what);
    }
}

#[test]
fn several_sets_with_several_threads() {
    let shot = Shot::new().with(|s| {
        s.threads = 2;
        s.samples_per_pixel = 20;
        s.shading = Shading::Bytes;
    });
    let alone = shot.alone();
    let result = shot.start(options(4, 2, WorkerKind::Threads)).finish();
    let result = result.expect("two sets");
    shot.check(&alone, &result, "two sets of two");
    check_set(&result, 2, "two sets of two");
}

#[test]
fn a_member_killed_at_any_moment_changes_no_bit() {
    for (name, integrator, gi) in integrators() {
        let shot = shot_of(integrator, gi).with(|s| s.samples_per_pixel = 12);
        let alone = shot.alone();
        for seed in 0..n_kills() {
            let what = format!("{name}, seed {seed}");
            let job = shot.start(options(2, 2, processes()));
            kill_one(&job, seed);
            let result = job.finish().expect(&what);
            shot.check(&alone, &result, &what);
        }
    }
}

#[test]
fn the_camera_sees_photons_of_a_scene_that_is_spread() {
    let shot = Shot::with_photons_seen();
    let alone = shot.alone();
    let result = shot.start(options(2, 2, processes())).finish();
    let what = "seen photons, a set of two";
    shot.check_photons_seen(&alone, &result.expect(what), what);
}

/// Caustic photons of which each member keeps a part.
fn divided(samples_per_pixel: u32) -> Shot {
    let gi = GlobalIllumination::Consistent;
    shot_of(Integrator::Kilauea, gi).with(|s| {
        s.samples_per_pixel = samples_per_pixel;
        s.photons.emitted_per_sample = Some(20_000);
        s.photons.split = PhotonSplit::Always;
    })
}

#[test]
fn each_member_keeps_its_part_of_the_photons() {
    let shot = divided(6);
    let alone = shot.alone();
    for size in [2, 3] {
        let what = format!("a set of {size}");
        let result = shot.start(options(size, size, processes())).finish();
        let result = result.expect(&what);
        shot.check(&alone, &result, &what);
        let stats = &result.frame.stats;
        let set = stats.set.as_ref().expect(&what);
        let lookups = set.rays.iter().find(|rays| rays.kind == "photons");
        assert!(
            lookups.is_some_and(|l| l.rays > 0 && l.met > 0),
            "{what}: {lookups:?}"
        );
        let n_all: u64 = set.members.iter().map(|member| member.photons).sum();
        assert!(n_all > 1000, "{what}: {n_all}");
        for member in &set.members {
            let share = member.photons as f64 / n_all as f64 * f64::from(size);
            assert!((share - 1.0).abs() < 0.2, "{what}: {:?}", set.members);
            assert!(
                member.photon_bytes > 28 * member.photons,
                "{what}: {member:?}"
            );
        }
        assert_eq!(alone.stats.photons.stored, stats.photons.stored, "{what}");
    }
}

#[test]
fn a_lookup_may_find_more_photons_than_a_reply_holds() {
    let mut shot = divided(1).with(|s| {
        s.resolution = [8, 4];
        s.photons.emitted_per_sample = Some(600_000);
        s.photons.radius = Some(8.0);
    });
    // The dome, most of whose light misses the glass.
    shot.stage.lights.pop();
    let alone = shot.alone();
    let result = shot.start(options(2, 2, processes())).finish();
    let result = result.expect("replies come in parts");
    shot.check(&alone, &result, "many photons");
    let set = result.frame.stats.set.expect("two members");
    let lookups = set.rays.iter().find(|rays| rays.kind == "photons");
    let lookups = lookups.expect("photons are looked up");
    // Who asks finds some wherever the other member does.
    let n_found_by_others = lookups.met / 2;
    assert!(
        lookups.bytes_from_members > n_found_by_others * 98_304 * 32,
        "{lookups:?}"
    );
}

#[test]
fn the_successor_of_a_member_gets_its_part_of_the_photons() {
    let shot = divided(12);
    let alone = shot.alone();
    for seed in 0..2 * n_kills() {
        let size = 2 + seed % 2;
        let what = format!("a set of {size}, seed {seed}");
        let job = shot.start(options(size, size, processes()));
        kill_one(&job, seed);
        let result = job.finish().expect(&what);
        shot.check(&alone, &result, &what);
    }
}

#[test]
fn other_sets_go_on_while_one_has_lost_a_member() {
    let shot = Shot::long();
    let alone = shot.alone();
    let job = shot.start(options(4, 2, processes()));
    wait_for_progress(&job, 0.2);
    signal("KILL", job.worker_pids()[0]);
    let result = job.finish().expect("two sets");
    shot.check(&alone, &result, "one of four killed");
    let lost: Vec<u32> = (result.workers.iter())
        .filter(|worker| worker.lost.is_some())
        .map(|worker| worker.rank)
        .collect();
    assert_eq!(lost, [0], "{:?}", result.workers);
}

#[test]
fn a_set_whose_member_cannot_be_replaced_is_given_up() {
    let shot = Shot::long();
    let alone = shot.alone();
    let without_restarts = |n_workers| ClusterOptions {
        max_restarts: 0,
        ..options(n_workers, 2, processes())
    };
    let job = shot.start(without_restarts(4));
    wait_for_progress(&job, 0.1);
    signal("KILL", job.worker_pids()[0]);
    let result = job.finish().expect("the other set goes on");
    shot.check(&alone, &result, "a set is lost");
    let lost = |rank: usize| result.workers[rank].lost.as_deref();
    assert!(lost(0).is_some() && lost(2).is_none() && lost(3).is_none());
    assert_eq!(lost(1), Some("member 0 of its set is lost"));

    let job = shot.start(without_restarts(2));
    wait_for_progress(&job, 0.1);
    signal("KILL", job.worker_pids()[0]);
    let error = job.finish().map(|_| ()).unwrap_err();
    assert!(matches!(error, ClusterError::NoWorkers { .. }), "{error}");
}

fn refusal(n_workers: u32, size: SetSize) -> String {
    let shot = Shot::new();
    let options = ClusterOptions {
        set: Some(SetOptions { size, ..CULLED }),
        ..frame::options(n_workers, WorkerKind::Threads)
    };
    let started = ClusterJob::start(&shot.scene(), &shot.settings, options);
    let error = started.map(|_| ()).expect_err("it cannot be spread");
    error.to_string()
}

#[test]
fn what_cannot_be_spread_is_refused_with_its_sizes() {
    let odd = refusal(3, SetSize::Workers(2));
    assert!(
        odd.contains("3 workers") && odd.contains("sets of 2"),
        "{odd}"
    );
    let none = refusal(2, SetSize::Workers(0));
    assert!(none.contains("not 0"), "{none}");
    let chunk = refusal(2, SetSize::Memory(1000));
    assert!(chunk.contains("1000") && chunk.contains('/'), "{chunk}");
}

#[test]
fn sets_are_as_small_as_memory_lets_them_be() {
    let shot = Shot::new();
    let scene = shot.scene();
    let bytes = SetPlan::even(&scene, 1).unwrap().bytes()[0];
    let with_memory = |n_workers, bytes| ClusterOptions {
        set: Some(SetOptions {
            size: SetSize::Memory(bytes),
            ..CULLED
        }),
        ..frame::options(n_workers, WorkerKind::Threads)
    };
    let result = shot.start(with_memory(4, bytes)).finish().unwrap();
    assert!(result.frame.stats.set.is_none(), "each holds all");
    // Two can hold the scene, as one large chunk is most of it; of three workers one would be left over.
    let largest = SetPlan::even(&scene, 3).unwrap();
    let largest = largest.bytes().iter().max().copied().unwrap();
    let alone = shot.alone();
    for (n_workers, size) in [(4, 2), (3, 3)] {
        let result = shot.start(with_memory(n_workers, largest)).finish();
        let result = result.unwrap();
        shot.check(&alone, &result, "by memory");
        let n_members = result.frame.stats.set.map(|set| set.members.len());
        assert_eq!(n_members, Some(size), "of {n_workers} workers");
    }
}

#[test]
fn sets_have_room_for_photons() {
    let shot = divided(2).with(|s| {
        s.photons.emitted_per_sample = Some(100);
        s.photons.split = PhotonSplit::WhereNeeded;
    });
    let scene = shot.scene();
    let photons = PhotonDemand::of(&scene, &shot.settings);
    let largest = SetPlan::even(&scene, 3).unwrap();
    let largest = largest.bytes().iter().max().copied().unwrap();
    // Two could hold the scene, but not with half of the photons of two passes each.
    let planned = photons.of_member(3);
    let options = ClusterOptions {
        set: Some(SetOptions {
            size: SetSize::Memory(largest + planned),
            ..CULLED
        }),
        ..frame::options(6, WorkerKind::Threads)
    };
    let result = shot.start(options).finish().unwrap();
    shot.check(&shot.alone(), &result, "with photons");
    let set = result.frame.stats.set.expect("three members");
    assert_eq!(set.members.len(), 3);
    let left = planned;
    assert_eq!(set.photon_room, Some(PhotonRoom { left, planned }));
    for member in &set.members {
        let of_two_passes = 2 * member.photon_bytes;
        assert!(
            member.photons > 0 && of_two_passes <= left,
            "{member:?} of {left}"
        );
    }
}
