//! Tiles of textures that shades ask for: the same picture whoever brings them, when, or whether.

use std::sync::Arc;

use kilauea_mesh::PrimvarInterpolation;
use kilauea_render::{Conditions, PrepareOptions, PreparedScene};
use kilauea_scene::{Channel, Input, Material, Node, RenderSettings, Shading, Wrap};
use kilauea_testing::TileFile;
use kilauea_tests::{Mesh, MeshPrimvar, Picture, Stage, perspective, rect_light};

/// Texels on the side of the image: 64 tiles of 48 KiB.
const SIZE: u32 = 512;
/// Room for two of them.
const TINY: u64 = 100 << 10;
const AMPLE: u64 = 64 << 20;

/// Milliseconds by which answers come late, in any order.
const LATE: f64 = 2.0;
const PROMPT: f64 = 0.0;

/// How late answers come, how shades wait for them, and on how many threads.
type Way = (f64, Shading, u32);

fn image() -> TileFile {
    TileFile::new([SIZE; 2], |x, y| {
        [x as f32 / SIZE as f32, y as f32 / SIZE as f32, 0.5]
    })
}

/// A floor whose albedo is the image, looked up where the image itself says: red and green are the
/// coordinates of a second lookup.
fn floor(image: &TileFile) -> Stage {
    let texture = |st, bias| Node::UvTexture {
        texture: 0,
        st,
        wrap_s: Wrap::Repeat,
        wrap_t: Wrap::Repeat,
        scale: [1.0; 4],
        bias: [bias; 4],
        fallback: [0.2, 0.4, 0.6, 1.0],
    };
    let st = Node::Primvar {
        name: "st".into(),
        fallback: [0.0; 4],
    };
    let albedo = Input {
        node: 2,
        channel: Channel::Rgb,
    };
    let mut floor = Mesh::floor(1.0);
    floor.primvars.push(MeshPrimvar {
        name: "st".into(),
        interpolation: PrimvarInterpolation::Vertex,
        values: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
            .map(|[s, t]| [s, t, 0.0])
            .concat(),
    });
    let mut stage = Stage::new(perspective([0.0, 1.5, 0.0], [0.0; 3], 0.6));
    stage.meshes.push(floor);
    stage.textures.push(image.source());
    stage.materials = vec![Material {
        path: "/Looks/Floor".into(),
        shader: "Matte".into(),
        inputs: [("albedo".to_owned(), albedo)].into(),
        nodes: vec![st, texture(0, 0.25), texture(1, 0.0)],
    }];
    stage.lights.push(rect_light(2.0, 2.0, 2.0));
    stage
}

/// The stage with no tile in memory.
fn prepare(stage: &Stage, budget_bytes: u64) -> Arc<PreparedScene> {
    let options = PrepareOptions {
        texture_memory_bytes: budget_bytes,
        ..PrepareOptions::default()
    };
    let scene = stage.scene(Stage::settings().resolution);
    Arc::new(PreparedScene::new(scene, &options).expect("the scene is sound"))
}

fn render(prepared: &Arc<PreparedScene>, (answer_delay_ms, shading, threads): Way) -> Picture {
    let conditions = Conditions {
        answer_delay_ms,
        ..Conditions::default()
    };
    let settings = RenderSettings {
        samples_per_pixel: 4,
        shading,
        threads,
        ..Stage::settings()
    };
    Picture::render_under(conditions, prepared, settings)
}

const INLINE: Way = (PROMPT, Shading::Inline, 1);
/// Ways in which shades wait.
const WAITING: [Way; 4] = [
    (PROMPT, Shading::Queued, 1),
    (PROMPT, Shading::Queued, 7),
    (LATE, Shading::Queued, 2),
    (PROMPT, Shading::Bytes, 2),
];

#[test]
fn tiles_that_are_asked_for_do_not_change_a_bit() {
    let image = image();
    let stage = floor(&image);
    let inline = render(&prepare(&stage, AMPLE), INLINE);
    assert!(inline.mean() > 0.01, "black");
    let textures = &inline.stats.textures;
    assert_eq!(textures.tiles_fetched, 0);
    assert!(textures.tiles_loaded > 30, "{}", textures.tiles_loaded);
    assert!(textures.seconds_waited > 0.0);
    for way in WAITING {
        let picture = render(&prepare(&stage, AMPLE), way);
        picture.check_same_bits(&inline, &format!("{way:?}"));
        // Each tile was there when it was looked up; and from afar came bytes.
        let found = &picture.stats.textures;
        assert_eq!(found.tiles_fetched, textures.tiles_loaded, "{way:?}");
        assert_eq!(found.seconds_waited, 0.0, "{way:?}");
        let is_far = way.1 == Shading::Bytes;
        assert_eq!(found.tiles_loaded == 0, is_far, "{way:?}");
    }
}

#[test]
fn tiles_that_had_to_go_again_do_not_change_a_bit() {
    let image = image();
    let stage = floor(&image);
    let inline = render(&prepare(&stage, AMPLE), INLINE);
    for way in WAITING.into_iter().chain([INLINE]) {
        let picture = render(&prepare(&stage, TINY), way);
        picture.check_same_bits(&inline, &format!("{way:?}"));
        assert!(picture.stats.memory.texture_tiles_peak <= TINY, "{way:?}");
    }
}

#[test]
fn an_image_that_cannot_be_read_is_named_once() {
    let mut pictures = WAITING.into_iter().chain([INLINE]).map(|way| {
        let image = image();
        let prepared = prepare(&floor(&image), AMPLE);
        drop(image);
        let picture = render(&prepared, way);
        let warnings = &picture.stats.warnings;
        assert_eq!(warnings.len(), 1, "{way:?}: {warnings:?}");
        assert!(
            warnings[0].starts_with("picture.exr: cannot read"),
            "{way:?}: {warnings:?}"
        );
        (way, picture)
    });
    let (_, first) = pictures.next().expect("there are several ways");
    for (way, picture) in pictures {
        picture.check_same_bits(&first, &format!("{way:?}"));
    }
}
