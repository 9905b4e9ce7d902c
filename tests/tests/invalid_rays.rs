//! Rays that cannot be traced are counted, and said.

use kilauea_render::RenderJob;
use kilauea_tests::{Mesh, Stage, looking_down, matte};

#[test]
fn rays_of_an_empty_range_are_counted() {
    let mut stage = Stage::new(looking_down(0.0, 0.0));
    stage.materials = vec![matte([0.5; 3])];
    stage.meshes.push(Mesh::floor(1.0));
    stage.camera.clipping_range = [0.2, 0.2];
    let prepared = stage.prepare(&Stage::settings());
    let job = RenderJob::start(prepared, Stage::settings()).expect("the settings are sound");
    let stats = job.finish().expect("nothing fails").stats;
    assert_eq!(stats.invalid_rays, stats.rays.camera);
    assert!(stats.invalid_rays > 0);
    let warning = stats
        .warnings
        .iter()
        .find(|w| w.contains("rays could not be traced"));
    assert!(warning.is_some(), "{:?}", stats.warnings);
}
