//! However many workers there are and whatever they are, the picture is that of one process.

mod frame;

use frame::{Shot, integrators, processes};
use kilauea_cluster::{ClusterError, ClusterOptions, WorkerKind, scene_from_bytes, scene_to_bytes};
use kilauea_render::RenderError;
use kilauea_scene::Shading;

fn check(kind: &WorkerKind, numbers: &[u32]) {
    for (name, integrator, gi) in integrators() {
        let shot = Shot::new().with(|s| {
            s.integrator = integrator;
            s.gi = gi;
            if name == "kilauea" {
                // In a frame as small as this it would learn nothing by itself.
                s.general = vec!["guided_lights".into(), "guided_directions".into()];
            }
        });
        let alone = shot.alone();
        for &n_workers in numbers {
            let what = format!("{name}, {n_workers} workers");
            let options = frame::options(n_workers, kind.clone());
            let result = shot.start(options).finish().expect(&what);
            shot.check(&alone, &result, &what);
            assert_eq!(result.workers.len(), n_workers as usize, "{what}");
            assert!(result.workers.iter().all(|w| w.lost.is_none()), "{what}");
            assert!(result.network.bytes_sent > 0 && result.network.bytes_received > 0);
            if name == "photons" {
                let (ours, theirs) = (&alone.stats, &result.frame.stats);
                assert!(theirs.photons.stored > 0, "{what}");
                assert_eq!(ours.rays.photon, theirs.rays.photon, "{what}");
                let shared = ["photons", "caustic photons"];
                assert_eq!(theirs.shared_passes, shared, "{what}");
            }
            if name == "kilauea" {
                let shared = ["training", "trial"];
                assert_eq!(result.frame.stats.shared_passes, shared, "{what}");
            }
        }
    }
}

#[test]
fn over_channels_of_bytes() {
    check(&WorkerKind::Threads, &[1, 2, 3]);
}

#[test]
fn over_tcp_between_processes() {
    check(&processes(), &[1, 2, 3]);
}

#[test]
fn where_the_camera_sees_photons() {
    let shot = Shot::with_photons_seen();
    let alone = shot.alone();
    for (kind, n_workers) in [(WorkerKind::Threads, 3), (processes(), 2)] {
        let what = format!("seen photons, {n_workers} workers");
        let result = shot.start(frame::options(n_workers, kind)).finish();
        shot.check_photons_seen(&alone, &result.expect(&what), &what);
    }
}

#[test]
fn where_paths_look_irradiance_up() {
    let shot = Shot::gathering();
    let alone = shot.alone();
    for (kind, n_workers) in [(WorkerKind::Threads, 3), (processes(), 2)] {
        let what = format!("final gathering, {n_workers} workers");
        let result = shot.start(frame::options(n_workers, kind)).finish();
        shot.check_gathering(&alone, &result.expect(&what), &what);
    }
}

#[test]
fn with_threads_more_units_and_a_window() {
    let shot = Shot::new().with(|s| {
        s.threads = 3;
        s.samples_per_pixel = 20;
        s.data_window = Some(kilauea_scene::DataWindow {
            min: [-3, 5],
            max: [61, 38],
        });
    });
    let result = shot.start(frame::options(2, WorkerKind::Threads)).finish();
    shot.check(
        &shot.alone(),
        &result.unwrap(),
        "two workers of three threads",
    );
}

#[test]
fn under_a_time_limit_workers_stop_in_time() {
    // Until a pass fits, however slow the machine is; all passes never do.
    let mut stats = (0..8).map(|doublings| {
        let shot = Shot::new().with(|s| {
            s.samples_per_pixel = 1 << 16;
            s.time_limit_secs = Some(f64::from(1 << doublings));
        });
        let options = frame::options(2, WorkerKind::Threads);
        shot.start(options).finish().unwrap().frame.stats
    });
    let stats = stats.find(|stats| stats.full_passes > 0);
    assert!(
        !stats
            .expect("two minutes are enough for a pass")
            .is_complete
    );
}

#[test]
fn a_scene_is_the_same_after_its_bytes() {
    let shot = Shot::new();
    let bytes = scene_to_bytes(&shot.scene());
    let mut scene = scene_from_bytes(&bytes).unwrap();
    assert_eq!(scene_to_bytes(&scene), bytes);
    // Which goes another way.
    scene.camera = shot.scene().camera;
    assert_eq!(format!("{:?}", shot.scene()), format!("{scene:?}"));
    for length in (0..bytes.len()).step_by(7) {
        assert!(
            scene_from_bytes(&bytes[..length]).is_err(),
            "{length} bytes"
        );
    }
}

#[test]
fn with_shades_that_wait() {
    let alone = Shot::new().alone();
    for shading in [Shading::Queued, Shading::Bytes] {
        let shot = Shot::new().with(|s| {
            s.shading = shading;
            s.threads = 2;
        });
        let result = shot.start(frame::options(2, WorkerKind::Threads)).finish();
        shot.check(&alone, &result.unwrap(), "shades that wait");
    }
}

#[test]
fn what_workers_cannot_do_is_refused_in_words() {
    let shot = Shot::new().with(|s| s.samples_per_pixel = 0);
    let refused = kilauea_cluster::ClusterJob::start(
        &shot.scene(),
        &shot.settings,
        frame::options(1, WorkerKind::Threads),
    );
    let error = refused.map(|_| ()).unwrap_err();
    assert!(
        matches!(error, ClusterError::Render(RenderError::Setting { .. })),
        "{error}"
    );
}

#[test]
fn a_program_that_is_no_worker_is_given_up() {
    let shot = Shot::new();
    let kind = WorkerKind::Processes {
        program: "/bin/false".into(),
        arguments: Vec::new(),
    };
    let options = ClusterOptions {
        max_restarts: 2,
        ..frame::options(1, kind)
    };
    let error = shot.start(options).finish().map(|_| ()).unwrap_err();
    let ClusterError::NoWorkers {
        n_started, reason, ..
    } = &error
    else {
        panic!("{error}");
    };
    assert_eq!(*n_started, 3);
    assert!(reason.contains("ended"), "{reason}");
}
