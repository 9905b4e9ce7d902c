//! What is in a journal is not rendered again.

mod frame;

use std::fs;
use std::path::PathBuf;

use frame::{Shot, integrators, wait_for_progress};
use kilauea_cluster::{ClusterError, ClusterOptions, JournalError, WorkerKind};
use kilauea_scene::Integrator;

/// A file of a test, removed when dropped.
struct TestFile(PathBuf);

impl TestFile {
    fn new(name: &str) -> Self {
        let name = format!("kilauea-test-{}-{name}.journal", std::process::id());
        let path = std::env::temp_dir().join(name);
        let _ = fs::remove_file(&path);
        Self(path)
    }
}

impl Drop for TestFile {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

fn options(journal: &TestFile) -> ClusterOptions {
    ClusterOptions {
        journal: Some(journal.0.clone()),
        ..frame::options(2, WorkerKind::Threads)
    }
}

/// Renders until some of the frame is done, and gives the bytes of the journal that is left.
fn break_off(shot: &Shot, journal: &TestFile) -> Vec<u8> {
    let job = shot.start(options(journal));
    wait_for_progress(&job, 0.3);
    job.cancel();
    let result = job.finish().expect("it is broken off, which is no error");
    assert!(!result.frame.stats.is_complete, "it was too fast");
    assert!(result.journal.is_none(), "it is still needed");
    fs::read(&journal.0).expect("there is a journal")
}

fn long_shot() -> Shot {
    // Units of one pass, so that many are in the journal.
    Shot::long().with(|s| s.threads = 4)
}

#[test]
fn the_rest_of_a_frame_is_rendered_and_the_pixels_are_the_same() {
    for (name, integrator, gi) in integrators() {
        let shot = long_shot().with(|s| {
            s.integrator = integrator;
            s.gi = gi;
            s.samples_per_pixel = 24;
        });
        let alone = shot.alone();
        let journal = TestFile::new(name);
        let kept = break_off(&shot, &journal);
        // Torn anywhere, within a frame or between two.
        for length in [kept.len() - 1, kept.len() / 2, 5] {
            fs::write(&journal.0, &kept[..length]).unwrap();
            let result = shot.start(options(&journal)).finish().unwrap();
            let what = format!("{name}, {length} bytes of a journal");
            shot.check(&alone, &result, &what);
            result.journal.expect(&what).remove().unwrap();
            assert!(!journal.0.exists(), "{what}: it is still there");
        }
    }
}

#[test]
fn nothing_that_is_kept_is_done_again() {
    // All rays are of units: none train.
    let shot = long_shot().with(|s| s.integrator = Integrator::Path);
    let journal = TestFile::new("counted");
    let kept = break_off(&shot, &journal);
    let done_by = |bytes: &[u8]| {
        fs::write(&journal.0, bytes).unwrap();
        let result = shot.start(options(&journal)).finish().unwrap();
        let rays: u64 = result.workers.iter().map(|worker| worker.rays).sum();
        let stats = &result.frame.stats;
        (
            rays,
            stats.rays.camera + stats.rays.shadow + stats.rays.indirect,
        )
    };
    let (all, total) = done_by(&[]);
    assert_eq!(all, total);
    let (rest, total) = done_by(&kept);
    assert!(rest < total * 8 / 10, "{rest} of {total} rays");
}

#[test]
fn journals_of_something_else_are_refused() {
    let mut shot = long_shot();
    let journal = TestFile::new("other");
    let kept = break_off(&shot, &journal);
    let refusal = |shot: &Shot| {
        let refused =
            kilauea_cluster::ClusterJob::start(&shot.scene(), &shot.settings, options(&journal));
        match refused.map(|_| ()) {
            Err(ClusterError::Journal(error)) => error,
            other => panic!("{other:?}"),
        }
    };
    shot.settings.seed = 1;
    let error = refusal(&shot);
    assert!(error.to_string().contains("settings"), "{error}");
    shot.settings.seed = 0;
    shot.stage.spheres[0].radius = 0.4;
    let error = refusal(&shot);
    assert!(error.to_string().contains("scene"), "{error}");
    assert_eq!(fs::read(&journal.0).unwrap(), kept, "it was changed");

    fs::write(
        &journal.0,
        b"This is a text that someone wrote and wants to keep.",
    )
    .unwrap();
    assert!(matches!(refusal(&shot), JournalError::Broken { .. }));
}
