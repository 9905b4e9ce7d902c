//! A worker of a set never has the whole scene: its memory is that of its part.

mod frame;

use frame::{options, processes};
use kilauea_cluster::{ClusterJob, ClusterOptions, SetOptions, SetSize};
use kilauea_render::{Broadcast, Packing};
use kilauea_scene::RenderSettings;
use kilauea_tests::{Points, Stage, rect_light};

/// Clouds of as many points as a chunk has.
const POINTS_PER_CLOUD: usize = 1 << 16;

/// A floor under clouds of points, one above the other.
fn clouds(n_clouds: u32) -> Stage {
    let mut stage = Stage::sphere_on_floor();
    stage.lights.push(rect_light(1.0, 1.0, 2.0));
    for cloud in 0..n_clouds {
        let point = |i: usize| {
            let [x, z] = [i % 256, i / 256].map(|i| i as f32 / 128.0 - 1.0);
            [x, 0.1 + 0.05 * cloud as f32, z]
        };
        let points: Vec<[f32; 3]> = (0..POINTS_PER_CLOUD).map(point).collect();
        stage.points.push(Points::new(&points, 0.002));
    }
    stage
}

/// Highest resident size of the largest worker, in bytes.
fn peak_of_workers(stage: &Stage, n_workers: u32, set: Option<SetOptions>) -> f64 {
    let settings = RenderSettings {
        resolution: [32, 32],
        samples_per_pixel: 1,
        ..Stage::settings()
    };
    let options = ClusterOptions {
        set,
        ..options(n_workers, processes())
    };
    let job = ClusterJob::start(&stage.scene(settings.resolution), &settings, options);
    let result = job
        .and_then(ClusterJob::finish)
        .expect("the stage is sound");
    let peaks = result.workers.iter().map(|worker| worker.peak_rss);
    peaks.max().expect("there are workers") as f64
}

#[test]
fn a_worker_of_three_takes_at_most_six_tenths_of_what_one_takes() {
    let without_clouds = peak_of_workers(&clouds(0), 1, None);
    // So many that what building a tree takes for a moment weighs little.
    let stage = clouds(24);
    let alone = peak_of_workers(&stage, 1, None) - without_clouds;
    let set = SetOptions {
        size: SetSize::Workers(3),
        broadcast: Broadcast::Culled,
        packing: Packing::Plain,
    };
    let of_set = peak_of_workers(&stage, 3, Some(set)) - without_clouds;
    let scene = stage.scene([32, 32]).n_bytes() as f64;
    assert!(alone > scene, "{alone} of a scene of {scene}");
    assert!(of_set < 0.6 * alone, "{of_set} of {alone}");
}
