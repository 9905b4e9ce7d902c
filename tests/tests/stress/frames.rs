//! The smallest frames: nothing in them, one pixel, no bounce.

use kilauea_scene::{RenderSettings, Shading};
use kilauea_tests::{
    Mesh, Picture, Stage, black_emitter, check_near, matte, perspective, rect_light,
};

fn camera() -> kilauea_scene::Camera {
    perspective([0.0, 2.0, 1.0], [0.0; 3], 0.3)
}

fn floor() -> Stage {
    let mut stage = Stage::new(camera());
    stage.materials = vec![matte([0.5; 3]), black_emitter(3.0)];
    stage.meshes.push(Mesh::floor(1.0));
    stage.lights.push(rect_light(1.0, 1.0, 2.0));
    stage
}

#[test]
fn an_empty_stage_is_black_however_it_is_rendered() {
    for shading in [Shading::Inline, Shading::Queued, Shading::Bytes] {
        for resolution in [[1, 1], [33, 7]] {
            let picture = Stage::new(camera()).render(|s| {
                s.shading = shading;
                s.resolution = resolution;
                s.threads = 3;
            });
            picture.check_finite("empty");
            assert_eq!((picture.mean(), picture.mean_of("A")), (0.0, 0.0));
            assert!(picture.stats.is_complete);
            assert_eq!(picture.stats.rays.shadow + picture.stats.rays.indirect, 0);
        }
    }
}

#[test]
fn without_bounces_emission_alone_is_seen() {
    let mut stage = floor();
    let render = |stage: &Stage| stage.render(|s| s.max_depth = 0);
    let dark = render(&stage);
    assert_eq!((dark.mean(), dark.mean_of("A")), (0.0, 1.0));
    stage.meshes[0].material = 1;
    let bright = render(&stage);
    check_near(bright.mean(), 3.0, 1e-6, "emission");
    assert_eq!(bright.stats.rays.shadow + bright.stats.rays.indirect, 0);
}

#[test]
fn one_pixel_is_the_mean_of_a_picture() {
    let render = |resolution, samples_per_pixel| {
        let settings = RenderSettings {
            resolution,
            samples_per_pixel,
            ..Stage::settings()
        };
        Picture::render(&floor().prepare(&settings), settings)
    };
    let (one, many) = (render([1, 1], 4096), render([16, 16], 64));
    assert_eq!(one.channel("R").len(), 1);
    check_near(one.mean(), many.mean(), 0.01, "one pixel");
    super::report(
        "frames",
        "one pixel over the mean of many",
        one.mean() / many.mean(),
    );
    // One sample is a picture too.
    render([1, 1], 1).check_finite("one sample");
}
