//! What it costs to spread a scene over a set of workers: processor time, memory and bytes of one worker
//! with all of it, and of workers that share it, in turns. Fails where a pixel differs.
//!
//! ```sh
//! cargo build -p kilauea-cluster --bin kilauea-worker
//! cargo run -p kilauea-cluster --example set_cost -- WORKERS ROUNDS [KIB]
//! ```
//!
//! With KIB, no worker of the set may have more data than that (`ulimit -d`).
#![allow(clippy::print_stdout, reason = "the figures are what it is for")]

mod spread_stage;

use std::error::Error;
use std::ffi::OsString;
use std::path::PathBuf;

use kilauea_cluster::{ClusterJob, ClusterOptions, ClusterResult, SetOptions, SetSize, WorkerKind};
use kilauea_film::Image;
use kilauea_render::{Broadcast, Packing};
use kilauea_scene::{RenderSettings, Scene};
use kilauea_tests::Stage;
use spread_stage::many_spheres;

/// Clock ticks of `/proc`, whatever the kernel's own are.
const TICKS_PER_SEC: f64 = 100.0;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<u32> = std::env::args()
        .skip(1)
        .map(|argument| argument.parse())
        .collect::<Result<_, _>>()?;
    let [n_workers, n_rounds, limits @ ..] = &arguments[..] else {
        return Err("WORKERS and ROUNDS are missing".into());
    };
    let settings = RenderSettings {
        resolution: [192, 108],
        samples_per_pixel: 8,
        max_depth: 6,
        ..Stage::settings()
    };
    let scene = many_spheres().scene(settings.resolution);
    println!("scene: {} bytes without its trees", scene.n_bytes());
    let set = SetOptions {
        size: SetSize::Workers(*n_workers),
        broadcast: Broadcast::Culled,
        packing: Packing::Plain,
    };
    let alone = ClusterOptions::new(1, worker(None)?);
    let spread = ClusterOptions {
        set: Some(set),
        ..ClusterOptions::new(*n_workers, worker(limits.first().copied())?)
    };
    let mut least = [f64::INFINITY; 2];
    for _ in 0..*n_rounds {
        let (whole, secs_alone) = render(&scene, &settings, &alone)?;
        let (shared, secs_shared) = render(&scene, &settings, &spread)?;
        if pixels(&whole, &scene) != pixels(&shared, &scene) {
            return Err("a pixel differs".into());
        }
        least = [least[0].min(secs_alone), least[1].min(secs_shared)];
        println!(
            "one worker:  {secs_alone:.2} s of processor, {}",
            memory(&whole)
        );
        println!(
            "a set of {n_workers}: {secs_shared:.2} s, {}",
            memory(&shared)
        );
        print_rays(&shared);
    }
    println!(
        "least: {:.2} s and {:.2} s, {:.2} times",
        least[0],
        least[1],
        least[1] / least[0]
    );
    Ok(())
}

/// The program beside this one, with so many KiB of data at most.
fn worker(limit_kib: Option<u32>) -> Result<WorkerKind, Box<dyn Error>> {
    let example = std::env::current_exe()?;
    let folder = example.parent().and_then(|examples| examples.parent());
    let program: PathBuf = folder
        .ok_or("where is this program?")?
        .join("kilauea-worker");
    let Some(kib) = limit_kib else {
        return Ok(WorkerKind::Processes {
            program,
            arguments: Vec::new(),
        });
    };
    let limited = format!("ulimit -d {kib}; exec \"$0\"");
    Ok(WorkerKind::Processes {
        program: "/bin/sh".into(),
        arguments: vec![OsString::from("-c"), limited.into(), program.into()],
    })
}

/// A frame, and the processor time of the workers that rendered it.
fn render(
    scene: &Scene,
    settings: &RenderSettings,
    options: &ClusterOptions,
) -> Result<(ClusterResult, f64), Box<dyn Error>> {
    let before = secs_of_children()?;
    let result = ClusterJob::start(scene, settings, options.clone())?.finish()?;
    Ok((result, secs_of_children()? - before))
}

/// Processor time of the processes that this one has started and waited for.
fn secs_of_children() -> Result<f64, Box<dyn Error>> {
    let stat = std::fs::read_to_string("/proc/self/stat")?;
    // The name of the program, in parentheses, may have spaces.
    let fields = stat.rsplit_once(") ").ok_or("/proc/self/stat is odd")?.1;
    // Fields 16 and 17 of proc(5), the first of these being the third.
    let ticks = fields.split(' ').skip(13).take(2).map(str::parse::<f64>);
    let ticks = ticks.collect::<Result<Vec<_>, _>>()?;
    Ok(ticks.iter().sum::<f64>() / TICKS_PER_SEC)
}

fn pixels(result: &ClusterResult, scene: &Scene) -> Image {
    result.frame.film.to_image(scene.origin_world)
}

fn memory(result: &ClusterResult) -> String {
    let peaks = result.workers.iter().map(|worker| worker.peak_rss);
    let peak = peaks.max().unwrap_or(0) / 1_000_000;
    let memory = result.frame.stats.memory;
    let held = (memory.scene + memory.accel) / 1_000_000;
    format!("{peak} MB at most in a worker, scene and trees {held} MB")
}

fn print_rays(result: &ClusterResult) {
    let Some(set) = &result.frame.stats.set else {
        return;
    };
    for rays in &set.rays {
        let each = |bytes: u64| bytes as f64 / rays.rays.max(1) as f64;
        println!(
            "  {}: {} rays, {:.2} members asked, {:.2} met; {:.1} bytes out, {:.1} back",
            rays.kind,
            rays.rays,
            each(rays.asked),
            each(rays.met),
            each(rays.bytes_to_members),
            each(rays.bytes_from_members),
        );
    }
    let secs = set.seconds_under_way / set.batches.max(1) as f64;
    println!(
        "  {} batches to others, {:.2} ms each",
        set.batches,
        1e3 * secs
    );
}
