//! What paths are told shows as the scene is: which lamp is behind a wall, and where light comes from.

use std::sync::Arc;

use kilauea_film::Image;
use kilauea_math::{DMat4, Spectrum, Vec3};
use kilauea_render::{
    EstimateLayer, EstimateReport, GatherEstimate, PreparedScene, estimate_picture,
};
use kilauea_scene::{Light, LightShape, RenderSettings};
use kilauea_tests::{Mesh, Stage, black_emitter, facing_down, light, matte, orthographic};

const RESOLUTION: [u32; 2] = [32, 32];

/// A floor, seen from above, with a wall across it and a lamp on either side.
fn two_rooms() -> Stage {
    let mut stage = Stage::new(orthographic([0.0, 3.0, 0.0], [0.0; 3], 1.0));
    stage.materials.push(matte([0.8; 3]));
    stage.meshes.push(Mesh::floor(1.0));
    let wall = [
        [0.0, 0.0, -1.0],
        [0.0, 0.0, 1.0],
        [0.0, 2.0, 1.0],
        [0.0, 2.0, -1.0],
    ];
    stage.meshes.push(Mesh::polygon(&wall));
    for x in [-0.3, 0.3] {
        let lamp = LightShape::Disk { radius: 0.05 };
        stage.lights.push(Light {
            radiance: Spectrum::splat(100.0),
            ..light(lamp, facing_down(x, 0.5, 0.0))
        });
    }
    stage
}

/// A floor, seen from above, beside a wall at −x that shines.
fn beside_a_shining_wall() -> Stage {
    let mut stage = Stage::new(orthographic([0.0, 3.0, 0.0], [0.0; 3], 1.0));
    stage.materials = vec![matte([0.8; 3]), black_emitter(5.0)];
    stage.meshes.push(Mesh::floor(1.0));
    let wall = [
        [-1.0, 0.0, -1.0],
        [-1.0, 0.0, 1.0],
        [-1.0, 0.5, 1.0],
        [-1.0, 0.5, -1.0],
    ];
    stage.meshes.push(Mesh::polygon(&wall).with_material(1));
    stage
}

/// Everything is learnt that can be.
fn settings() -> RenderSettings {
    RenderSettings {
        resolution: RESOLUTION,
        samples_per_pixel: 512,
        max_depth: 3,
        general: vec!["guided_lights".into(), "guided_directions".into()],
        ..Stage::settings()
    }
}

fn learn(stage: &Stage) -> (Arc<PreparedScene>, GatherEstimate) {
    let prepared = stage.prepare(&settings());
    let learnt = GatherEstimate::of(Arc::clone(&prepared), settings());
    (prepared, learnt.expect("the settings are sound"))
}

fn picture(stage: &Stage, shown: EstimateLayer) -> Image {
    let (prepared, learnt) = learn(stage);
    let picture = estimate_picture(&prepared, &learnt, RESOLUTION, 2, Some(shown));
    picture.expect("no shader panics").expect("all is learnt")
}

/// Values of a channel in the left and the right half, a few pixels from their common edge.
fn halves(image: &Image, name: &str) -> [Vec<f32>; 2] {
    let samples = image.channel(name).unwrap_or_else(|| panic!("no {name}"));
    let columns = [0..13, 19..32];
    columns.map(|columns| {
        let of_row = |row: usize| samples[row * 32..][columns.clone()].iter().copied();
        (0..32).flat_map(of_row).collect()
    })
}

fn mean(values: &[f32]) -> f32 {
    values.iter().sum::<f32>() / values.len() as f32
}

#[test]
fn the_likeliest_light_is_the_one_that_no_wall_hides() {
    let image = picture(&two_rooms(), EstimateLayer::Lights);
    let [left, right] = halves(&image, "lights.top");
    for (half, light) in [(left, 0.0), (right, 1.0)] {
        let n_right = half.iter().filter(|&&top| top == light).count();
        assert!(
            n_right as f32 > 0.95 * half.len() as f32,
            "{n_right} {light}"
        );
    }
    for half in halves(&image, "lights.number") {
        assert!(half.iter().all(|&number| number == 1.0), "{half:?}");
    }
    let told = halves(&image, "lights.probability").concat();
    let plain = halves(&image, "lights.plain").concat();
    // One in five lights is chosen as before.
    let expected = 0.2 * mean(&plain) + 0.8;
    let (told, plain) = (mean(&told), mean(&plain));
    assert!(told > plain + 0.6 * (expected - plain), "{told} {plain}");
    let [red, green, blue] = ["R", "G", "B"].map(|c| halves(&image, c));
    let apart = |c: [Vec<f32>; 2]| (mean(&c[0]) - mean(&c[1])).abs();
    assert!(apart(red) + apart(green) + apart(blue) > 0.5);
}

#[test]
fn with_nothing_between_lamps_and_floor_the_nearer_one_is_likeliest_as_before() {
    let mut stage = two_rooms();
    stage.meshes.truncate(1);
    let image = picture(&stage, EstimateLayer::Lights);
    let told = halves(&image, "lights.probability").concat();
    let plain = halves(&image, "lights.plain").concat();
    let (told, plain) = (mean(&told), mean(&plain));
    assert!((told - plain).abs() < 0.12, "{told} {plain}");
}

#[test]
fn the_mean_direction_points_to_where_light_comes_from() {
    let mut stage = beside_a_shining_wall();
    // Direct light is found by light samples too; directions record it where rays meet the wall.
    let image = picture(&stage, EstimateLayer::Directions);
    let x = halves(&image, "guide.X").concat();
    assert!(mean(&x) < -0.4, "{}", mean(&x));
    let peak = halves(&image, "guide.peak").concat();
    assert!(peak.iter().all(|&peak| peak > 2.0));
    let (red, blue) = (halves(&image, "R").concat(), halves(&image, "B").concat());
    assert!(mean(&red) < 0.35 && (mean(&blue) - 0.5).abs() < 0.1);
    // Under an even sky light comes from above, and from no side.
    stage.meshes.truncate(1);
    stage.lights.push(light(LightShape::Dome, DMat4::IDENTITY));
    let image = picture(&stage, EstimateLayer::Directions);
    let axis = |name: &str| mean(&halves(&image, name).concat());
    let direction = Vec3::new(axis("guide.X"), axis("guide.Y"), axis("guide.Z"));
    assert!(direction.y > 0.4 && direction.x.abs() < 0.1, "{direction}");
}

#[test]
fn where_nothing_is_seen_there_is_no_cell() {
    let mut stage = two_rooms();
    stage.camera = orthographic([0.0, 3.0, 0.0], [0.0; 3], 2.0);
    let image = picture(&stage, EstimateLayer::Lights);
    for name in ["lights.cell", "lights.top", "guide.cell"] {
        let samples = image.channel(name).expect(name);
        assert_eq!(samples[0], -1.0, "{name}");
        assert!(samples[16 * 32 + 12] >= 0.0, "{name}");
    }
}

#[test]
fn what_paths_are_not_told_has_a_reason_and_no_picture() {
    let stage = two_rooms();
    let plain = RenderSettings {
        general: Vec::new(),
        ..settings()
    };
    let prepared = stage.prepare(&plain);
    let short = RenderSettings {
        samples_per_pixel: 4,
        ..plain.clone()
    };
    for (settings, has_pilot) in [(plain, true), (short, false)] {
        let learnt = GatherEstimate::of(Arc::clone(&prepared), settings).expect("sound settings");
        let skipped = learnt.skipped();
        let of_directions = skipped.last().expect("directions do not pay");
        assert!(of_directions.starts_with("directions: "), "{skipped:?}");
        assert_eq!(
            of_directions.contains("no pilot"),
            !has_pilot,
            "{skipped:?}"
        );
        let shown = Some(EstimateLayer::Directions);
        let picture = estimate_picture(&prepared, &learnt, RESOLUTION, 1, shown);
        assert_eq!(picture.expect("no shader panics"), None);
    }
    let (_, learnt) = learn(&stage);
    assert_eq!(learnt.skipped(), [""; 0]);
}

#[test]
fn a_report_names_the_prims_whose_light_is_likeliest() {
    let mut stage = two_rooms();
    stage.lights[0].path = "/Left".into();
    stage.lights[1].path = "/Right".into();
    stage
        .lights
        .insert(0, light(LightShape::Dome, DMat4::IDENTITY));
    // Black, so that it is no light at all.
    stage.lights[0].radiance = Spectrum::BLACK;
    let (prepared, learnt) = learn(&stage);
    let picture = estimate_picture(&prepared, &learnt, RESOLUTION, 1, None);
    let picture = picture.expect("no shader panics");
    let report = EstimateReport::of(&prepared, &learnt, picture.as_ref());
    let paths: Vec<&str> = report.lights.keys().map(String::as_str).collect();
    assert_eq!(paths, ["/Left", "/Right"]);
    assert!(
        report.lights.values().all(|&n_pixels| n_pixels > 400),
        "{:?}",
        report.lights
    );
    assert!(report.gather.cells > 0 && report.gather.light_cells > 0);
}

#[test]
fn triangles_that_shine_are_named_by_their_mesh() {
    let (prepared, learnt) = learn(&beside_a_shining_wall());
    let picture = estimate_picture(&prepared, &learnt, RESOLUTION, 1, None);
    let picture = picture.expect("no shader panics");
    let report = EstimateReport::of(&prepared, &learnt, picture.as_ref());
    let wall = prepared.scene.prim_path(1);
    assert_eq!(report.lights.keys().collect::<Vec<_>>(), [wall]);
}
