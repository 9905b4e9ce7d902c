//! A frame whose instructions are counted: matte, plastic and metal in a room under a rect light.
//!
//! ```text
//! cargo build --release -p kilauea-tests --example room
//! valgrind --tool=callgrind target/release/examples/room [plain | inline | queued | bytes | late]
//!     [frames=1] [side=48] [threads=1] [mib=256]
//! ```
//!
//! `late` is `queued` with each answer up to 10 ms late, `mib` the memory of shades that wait.

use std::error::Error;
use std::io::Write;
use std::sync::Arc;
use std::time::Instant;

use kilauea_math::{DAffine3, DVec3};
use kilauea_render::{Conditions, PreparedScene};
use kilauea_scene::{RenderSettings, Shading};
use kilauea_tests::{Mesh, Picture, Stage, matte, perspective, preview, rect_light};

fn room() -> Stage {
    let mut stage = Stage::new(perspective([0.0, 0.0, 0.9], [0.0, 0.0, -1.0], 0.6));
    stage.materials = vec![
        matte([0.7, 0.6, 0.5]),
        preview(&[("diffuseColor", &[0.2, 0.4, 0.8]), ("roughness", &[0.3])]),
        preview(&[
            ("diffuseColor", &[0.9, 0.9, 0.8]),
            ("metallic", &[1.0]),
            ("roughness", &[0.2]),
        ]),
    ];
    stage.meshes.push(Mesh::cube());
    for (material, x) in (0..).zip([-0.5, 0.0, 0.5]) {
        let place = DAffine3::from_translation(DVec3::new(x, -0.6, -0.3))
            * DAffine3::from_scale(DVec3::splat(0.2));
        stage
            .meshes
            .push(Mesh::cube().placed(place).with_material(material));
    }
    stage.lights.push(rect_light(0.8, 0.8, 0.9));
    stage
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let way = arguments.next().unwrap_or_else(|| "inline".into());
    let mut n_frames = 1;
    let mut settings = RenderSettings {
        resolution: [48, 48],
        samples_per_pixel: 8,
        shading: match way.as_str() {
            "plain" | "inline" => Shading::Inline,
            "queued" | "late" => Shading::Queued,
            "bytes" => Shading::Bytes,
            _ => return Err(format!("{way} is no way to answer questions").into()),
        },
        ..Stage::settings()
    };
    for argument in arguments {
        let (name, value) = argument.split_once('=').ok_or("NAME=NUMBER is missing")?;
        let value: u32 = value.parse()?;
        match name {
            "frames" => n_frames = value,
            "side" => settings.resolution = [value; 2],
            "threads" => settings.threads = value,
            "mib" => settings.shade_memory_bytes = u64::from(value) << 20,
            _ => return Err(format!("{name} cannot be chosen").into()),
        }
    }
    let conditions = Conditions {
        plain_loop: way == "plain",
        answer_delay_ms: if way == "late" { 10.0 } else { 0.0 },
        ..Conditions::default()
    };
    let prepared = room().prepare(&settings);
    for _ in 0..n_frames {
        render(&prepared, conditions, &settings)?;
    }
    Ok(())
}

/// Renders a frame and prints what it was like.
fn render(
    prepared: &Arc<PreparedScene>,
    conditions: Conditions,
    settings: &RenderSettings,
) -> std::io::Result<()> {
    let start = Instant::now();
    let picture = Picture::render_under(conditions, prepared, settings.clone());
    let ns = start.elapsed().as_secs_f64() * 1e9;
    let rays = &picture.stats.rays;
    let n_rays = rays.camera + rays.shadow + rays.indirect;
    let mut out = std::io::stdout().lock();
    writeln!(
        out,
        "{n_rays} rays, {:.1} ns each; mean {:?}; {} bytes of shades in flight, {} shades, {} \
         questions; threads {:.1} % busy",
        ns / n_rays as f64,
        picture.mean(),
        picture.stats.memory.shades_in_flight_peak,
        picture.stats.shades.in_flight_peak,
        picture.stats.shades.questions_at_peak,
        100.0 * picture.stats.shades.busy,
    )
}
