//! A stage of many chunks.

use kilauea_tests::{Points, Sphere, Stage, rect_light};

/// Balls in rows, and clouds of points, each of which is a chunk or more.
pub(crate) fn many_spheres() -> Stage {
    let mut stage = Stage::sphere_on_floor();
    stage.lights.push(rect_light(1.0, 1.0, 2.0));
    let ball = stage.spheres[0];
    for i in 0..64 {
        let [x, z] = [i % 8, i / 8].map(|i| 0.25 * f64::from(i) - 1.0);
        stage.spheres.push(Sphere {
            center: [x, 0.1, z],
            radius: 0.1,
            ..ball
        });
    }
    for cloud in 0..24_u8 {
        let point = |i: u16| {
            let [x, z] = [i % 256, i / 256].map(|i| f32::from(i) / 128.0 - 1.0);
            [x, 0.25 + 0.03 * f32::from(cloud), z]
        };
        let points: Vec<[f32; 3]> = (0..u16::MAX).map(point).collect();
        stage.points.push(Points::new(&points, 0.003));
    }
    stage
}
