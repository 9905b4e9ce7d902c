//! Two mirrors that face each other, and glass between them: paths are long, and where answers
//! take time all that are under way must fit into the memory for shades.

use kilauea_render::Conditions;
use kilauea_scene::{RenderSettings, Shading};
use kilauea_tests::{Mesh, Picture, Sphere, Stage, matte, perspective, preview, rect_light};

const BUDGET_BYTES: u64 = 1 << 16;
/// What a pixel takes that waits for an answer. One for each thread may be beyond the budget.
const PIXEL_BYTES: u64 = 1024;

fn hall() -> Stage {
    let mut stage = Stage::new(perspective([-0.8, 1.1, 1.6], [0.6, 0.9, 0.2], 0.6));
    let mirror = preview(&[
        ("diffuseColor", &[0.97, 0.98, 0.97]),
        ("metallic", &[1.0]),
        ("roughness", &[0.0]),
    ]);
    let glass = preview(&[("opacity", &[0.0]), ("roughness", &[0.0])]);
    stage.materials = vec![matte([0.6, 0.58, 0.55]), mirror, glass];
    stage.meshes.push(Mesh::floor(2.0));
    for x in [-1.0, 1.0] {
        let corners = [[x, 0.0, 4.0], [x, 0.0, -4.0], [x, 2.2, -4.0], [x, 2.2, 4.0]];
        stage.meshes.push(Mesh::polygon(&corners).with_material(1));
    }
    stage.spheres.push(Sphere {
        center: [0.25, 0.45, 0.9],
        radius: 0.45,
        material: 2,
    });
    stage.lights.push(rect_light(1.0, 3.0, 2.2));
    stage
}

fn settings(shading: Shading) -> RenderSettings {
    RenderSettings {
        resolution: [64, 36],
        samples_per_pixel: 2,
        max_depth: 64,
        threads: 2,
        shading,
        shade_memory_bytes: BUDGET_BYTES,
        ..Stage::settings()
    }
}

#[test]
fn shades_keep_within_their_memory_and_without_the_rule_pass_it_tenfold() {
    let prepared = hall().prepare(&settings(Shading::Inline));
    let inline = Picture::render(&prepared, settings(Shading::Inline));
    let rays = &inline.stats.rays;
    assert!(rays.indirect > 2 * rays.camera, "{rays:?}");
    let render = |first_come, answer_delay_ms| {
        let conditions = Conditions {
            first_come,
            answer_delay_ms,
            ..Conditions::default()
        };
        let picture = Picture::render_under(conditions, &prepared, settings(Shading::Queued));
        inline.check_same_bits(&picture, &format!("{conditions:?}"));
        let peak = picture.stats.memory.shades_in_flight_peak;
        (peak, picture.stats.shades.in_flight_peak)
    };
    for (peak, _) in [render(false, 0.0), render(false, 1.0)] {
        assert!(peak < BUDGET_BYTES + 2 * PIXEL_BYTES, "{peak} bytes");
    }
    let (peak, n_shades) = render(true, 0.0);
    assert!(peak > 10 * BUDGET_BYTES, "{peak} bytes");
    assert!(
        peak < n_shades * PIXEL_BYTES,
        "{peak} bytes of {n_shades} shades"
    );
}
