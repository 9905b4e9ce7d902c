//! What a pilot told is kept in a file for the same frame, and for no other.

mod frame;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use frame::Shot;
use kilauea_cluster::{
    EstimatesError, EstimatesOf, load_estimates, load_estimates_of, save_estimates,
};
use kilauea_render::{Conditions, GatherEstimate, PreparedScene, RenderJob, RenderResult};
use kilauea_scene::Integrator;

/// A file of a test, removed when dropped.
struct TestFile(PathBuf);

impl TestFile {
    fn new(name: &str) -> Self {
        let name = format!("kilauea-test-{}-{name}.estimates", std::process::id());
        Self(std::env::temp_dir().join(name))
    }
}

impl Drop for TestFile {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

/// A shot in which all is learnt that can be.
fn shot() -> Shot {
    Shot::new().with(|s| {
        s.integrator = Integrator::Kilauea;
        s.general = vec!["guided_directions".into(), "guided_lights".into()];
    })
}

fn of(shot: &Shot, prepared: &PreparedScene) -> EstimatesOf {
    EstimatesOf::frame(&prepared.scene, &shot.settings)
}

/// Renders a shot, with a pilot of its own or what is told. Returns what there was to tell, too.
fn render(
    shot: &Shot,
    prepared: &Arc<PreparedScene>,
    told: Option<GatherEstimate>,
) -> (RenderResult, Arc<GatherEstimate>) {
    let (prepared, settings) = (Arc::clone(prepared), shot.settings.clone());
    let job = match told {
        None => RenderJob::start(prepared, settings),
        Some(told) => RenderJob::start_told(Conditions::default(), prepared, settings, told),
    };
    let job = job.expect("the settings are sound");
    while !job.wait(std::time::Duration::from_secs(1)) {}
    let learnt = job.learnt();
    (job.finish().expect("no shader panics"), learnt)
}

fn bits(result: &RenderResult) -> Vec<Vec<u32>> {
    let image = result.film.to_image(kilauea_math::DVec3::ZERO);
    let channels = image.channels.iter();
    channels
        .map(|channel| channel.samples.iter().map(|s| s.to_bits()).collect())
        .collect()
}

#[test]
fn what_was_told_before_gives_the_same_pixels_without_a_pilot() {
    let shot = shot();
    let prepared = shot.stage.prepare(&shot.settings);
    let file = TestFile::new("kept");
    let (first, learnt) = render(&shot, &prepared, None);
    save_estimates(&file.0, of(&shot, &prepared), &learnt).expect("it can be written");

    let told = load_estimates(&file.0, &of(&shot, &prepared)).expect("it is of this frame");
    assert_eq!(told, *learnt);
    let (again, _) = render(&shot, &prepared, Some(told));
    assert_eq!(bits(&first), bits(&again));
    assert!(first.stats.gather.light_cells > 0 && first.stats.gather.cells > 0);
    assert_eq!(first.stats.gather, again.stats.gather);
    let n_rays = |result: &RenderResult| result.stats.rays.camera;
    let n_samples = first.stats.samples;
    assert!(n_rays(&first) > n_samples, "there was no pilot");
    assert_eq!(n_rays(&again), n_samples, "there was a pilot again");
}

#[test]
fn threads_and_layers_do_not_matter_and_all_else_does() {
    let shot = shot();
    let prepared = shot.stage.prepare(&shot.settings);
    let file = TestFile::new("other");
    let saved = of(&shot, &prepared);
    save_estimates(&file.0, saved, &GatherEstimate::default()).expect("it can be written");

    let same = self::shot().with(|s| {
        s.threads = 7;
        s.aovs = vec!["N".into()];
    });
    load_estimates(&file.0, &of(&same, &prepared)).expect("it is of this frame");

    let longer = self::shot().with(|s| s.samples_per_pixel += 1);
    check_other(&file.0, &of(&longer, &prepared), "set of settings");
    load_estimates_of(&file.0, &prepared.scene).expect("they can be looked at");
    let mut moved = (*prepared.scene).clone();
    moved.camera.lens_radius += 0.01;
    let refused = load_estimates_of(&file.0, &moved);
    assert!(refused.is_err_and(|error| error.to_string().contains("camera")));
    let moved = EstimatesOf::frame(&moved, &shot.settings);
    check_other(&file.0, &moved, "camera");
    let mut darker = self::shot();
    darker.stage.lights.truncate(1);
    let prepared = darker.stage.prepare(&darker.settings);
    check_other(&file.0, &of(&darker, &prepared), "scene");
}

fn check_other(path: &Path, of: &EstimatesOf, expected: &str) {
    match load_estimates(path, of) {
        Err(EstimatesError::Other { what, .. }) => assert_eq!(what, expected),
        found => panic!("{expected}: {found:?}"),
    }
}

#[test]
fn files_that_are_damaged_are_refused() {
    let shot = shot();
    let prepared = shot.stage.prepare(&shot.settings);
    let of = of(&shot, &prepared);
    let file = TestFile::new("damaged");
    let (_, learnt) = render(&shot, &prepared, None);
    save_estimates(&file.0, of, &learnt).expect("it can be written");
    let whole = fs::read(&file.0).expect("it was written");
    let refuse = |bytes: &[u8], what: &str| {
        fs::write(&file.0, bytes).expect("it can be written");
        let found = load_estimates(&file.0, &of);
        assert!(
            matches!(found, Err(EstimatesError::Broken { .. })),
            "{what}"
        );
    };
    for length in [0, 7, 30, 100, whole.len() - 1] {
        refuse(&whole[..length], "torn");
    }
    for at in [3, 20, 60, whole.len() / 2, whole.len() - 1] {
        let mut flipped = whole.clone();
        flipped[at] ^= 1;
        refuse(&flipped, "flipped");
    }
    fs::remove_file(&file.0).expect("it was written");
    assert!(matches!(
        load_estimates(&file.0, &of),
        Err(EstimatesError::Io { .. })
    ));
}
