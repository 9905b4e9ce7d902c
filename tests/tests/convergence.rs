//! How fast error falls with samples.

use kilauea_math::{DAffine3, DVec3};
use kilauea_scene::RenderSettings;
use kilauea_tests::{Mesh, Picture, Stage, matte, perspective, rect_light};

/// A closed box with a block in it and a rect light below its ceiling, seen from inside.
fn closed_box() -> Stage {
    let mut stage = Stage::new(perspective([0.0, 0.0, 0.95], [0.0, -0.2, -1.0], 0.8));
    stage.materials = vec![matte([0.7; 3]), matte([0.6, 0.1, 0.1])];
    stage.meshes.push(Mesh::cube());
    let block = DAffine3::from_translation(DVec3::new(0.3, -0.7, -0.3))
        * DAffine3::from_rotation_y(0.3)
        * DAffine3::from_scale(DVec3::splat(0.3));
    stage
        .meshes
        .push(Mesh::cube().with_material(1).placed(block));
    stage.lights.push(rect_light(0.5, 0.5, 0.98));
    stage
}

/// Squared error falls at least as 1 / n^0.9; independent samples give 1 / n.
#[test]
fn squared_error_falls_with_samples() {
    let stage = closed_box();
    let prepared = stage.prepare(&Stage::settings());
    let render = |samples_per_pixel, seed| {
        Picture::render(
            &prepared,
            RenderSettings {
                resolution: [8, 8],
                samples_per_pixel,
                seed,
                max_depth: 5,
                ..Stage::settings()
            },
        )
    };
    let reference = render(8192, 1000);
    let errors = [4, 16, 64, 256].map(|samples| {
        let of_seed = |seed| {
            let picture = render(samples, seed);
            let pairs = picture.channel("G").iter().zip(reference.channel("G"));
            pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>() / 64.0
        };
        let mse = (0..6).map(of_seed).sum::<f64>() / 6.0;
        (f64::from(samples).ln(), mse.ln())
    });
    let slope = slope(&errors);
    eprintln!("slope {slope:.3}, ln MSE {errors:?}");
    assert!((-1.6..=-0.9).contains(&slope), "slope {slope}, {errors:?}");
}

/// Least squares.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (x, y) = points
        .iter()
        .fold((0.0, 0.0), |(sx, sy), (x, y)| (sx + x / n, sy + y / n));
    let products: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    products / points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}
