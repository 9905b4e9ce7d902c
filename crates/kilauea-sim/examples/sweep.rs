//! Sweeps set sizes, networks and numbers of machines over a trace of rays, and writes a table as
//! JSON: `cargo run --release -p kilauea-sim --example sweep -- TRACE.json MRAYS SHADE_NS > sweep.json`.
//! `MRAYS` is what one machine traces, in millions of rays a second, and `SHADE_NS` what shading adds
//! to each ray, in nanoseconds.
#![allow(clippy::print_stdout, reason = "a command")]

use kilauea_sim::{Batching, FarmModel, Machine, RaySizes, RayTrace, SetModel, law};
use serde_json::json;

/// Rays of a frame of 1920 by 1080 pixels, 64 samples and 8 rays a sample.
const FRAME_RAYS: f64 = 1920.0 * 1080.0 * 64.0 * 8.0;

/// Of a core, 25 microseconds (docs/scaling.md); here of a machine with 16.
const MESSAGE_SECS: f64 = 25e-6 / 16.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [path, mrays, shade_ns] = &args[..] else {
        return Err("usage: sweep TRACE.json MRAYS SHADE_NS".into());
    };
    let trace = RayTrace::from_json(&std::fs::read_to_string(path)?)?;
    let (mrays, shade_ns): (f64, f64) = (mrays.parse()?, shade_ns.parse()?);
    let mut rows = Vec::new();
    for gigabits in [1.0, 10.0, 100.0] {
        let machine = Machine {
            shade_secs: 1e-9 * shade_ns,
            message_secs: MESSAGE_SECS,
            ..Machine::new(mrays, gigabits)
        };
        for n_members in [1, 2, 3, 5, 8, 16, 32] {
            for is_full in [false, true] {
                rows.push(row(&trace, machine, (n_members, gigabits), is_full));
            }
        }
    }
    println!("{}", serde_json::to_string_pretty(&rows)?);
    Ok(())
}

fn row(
    trace: &RayTrace,
    machine: Machine,
    (n_members, gigabits): (usize, f64),
    is_full: bool,
) -> serde_json::Value {
    let model = SetModel {
        machines: vec![machine; n_members],
        sizes: RaySizes::default(),
        batching: Batching {
            pool: if n_members > 8 { 16 << 10 } else { 32 << 10 },
            ..Batching::default()
        },
        trace,
        is_full_broadcast: is_full,
        saved_by_own: 0.0,
    };
    let asking = trace.asking(n_members, is_full);
    let by_law = law::rays_per_machine(&machine, &asking, &model.sizes);
    // Long enough for every place in the pool to be used many times over.
    let secs_around = model.batching.pool as f64 / by_law;
    let outcome = model.run(4.0 * secs_around, 8.0 * secs_around);
    let per_machine = outcome.rays_per_sec() / n_members as f64;
    let frames = [1, 10, 100, 1000].map(|n_machines| {
        let n_sets = n_machines / n_members;
        let farm = FarmModel {
            set_rays_per_sec: vec![outcome.rays_per_sec(); n_sets],
            n_members,
            n_tiles: 2040 * 7,
            tile_rays: FRAME_RAYS / (2040.0 * 7.0),
            tile_spread: 2.0,
            mean_secs_to_failure: 30.0 * 86_400.0,
            recovery_secs: 8.0,
        };
        let frame = (n_sets > 0).then(|| farm.frame(1));
        json!({
            "machines": n_machines,
            "seconds": frame.map(|frame| frame.seconds),
            "efficiency": frame.map(|frame| frame.efficiency),
        })
    });
    json!({
        "gigabits": gigabits,
        "members": n_members,
        "full": is_full,
        "asked": asking.asked,
        "met": asking.met,
        "imbalance": asking.imbalance,
        "mrays_per_machine": 1e-6 * per_machine,
        "law_mrays_per_machine": 1e-6 * by_law,
        "busy": outcome.busy.iter().sum::<f64>() / n_members as f64,
        "batch_rays": outcome.batch_rays,
        "frames": frames,
    })
}
