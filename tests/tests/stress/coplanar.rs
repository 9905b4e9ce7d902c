//! Many surfaces in one place.

use kilauea_scene::{FilterKind, RenderSettings};
use kilauea_tests::{Mesh, Picture, Stage, looking_down, matte, rect_light};
use std::time::Instant;

/// `n` equal squares in one plane, in meshes of different colors; the first is red.
fn pile(n: usize) -> Stage {
    const N_MESHES: usize = 10;
    let mut stage = Stage::new(looking_down(0.0, 0.0));
    stage.materials = vec![matte([0.9, 0.1, 0.1]), matte([0.1, 0.9, 0.1])];
    let n_each = n / N_MESHES;
    for idx in 0..N_MESHES {
        let mut mesh = Mesh::floor(1.0).with_material(u32::from(idx > 0));
        mesh.counts = vec![4; n_each];
        mesh.indices = (0..4).cycle().take(4 * n_each).collect();
        stage.meshes.push(mesh);
    }
    stage.lights.push(rect_light(1.0, 1.0, 2.0));
    stage
}

fn check(n: usize, resolution: [u32; 2]) {
    let settings = RenderSettings {
        resolution,
        samples_per_pixel: 1,
        filter: FilterKind::Box,
        ..Stage::settings()
    };
    let mut alone = pile(n);
    alone.meshes.truncate(1);
    alone.meshes[0].counts.truncate(1);
    alone.meshes[0].indices.truncate(4);
    let expected = Picture::render(&alone.prepare(&settings), settings.clone());
    let start = Instant::now();
    let prepared = pile(n).prepare(&settings);
    let built = start.elapsed().as_secs_f64();
    for threads in [1, 3] {
        let settings = RenderSettings {
            threads,
            ..settings.clone()
        };
        let picture = Picture::render(&prepared, settings);
        // The lowest of equally near ones is seen, and it hides no light from itself.
        expected.check_same_bits(&picture, &format!("{n} squares, {threads} threads"));
    }
    super::report("coplanar", format!("{n} squares, seconds to build"), built);
}

#[test]
fn the_first_of_coplanar_squares_is_seen() {
    check(10_000, [16, 16]);
}

#[test]
#[ignore = "a ray that meets a million squares looks at each"]
fn the_first_of_a_million_coplanar_squares_is_seen() {
    check(1_000_000, [4, 4]);
}
