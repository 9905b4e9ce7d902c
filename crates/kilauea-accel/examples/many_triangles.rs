//! A mesh of millions: `cargo run --release -p kilauea-accel --example many_triangles -- 1e7`.
//!
//! Builds a closed sphere of about so many triangles, validates the tree,
//! shoots rays from inside, of which none may get out, and prints times and memory.
#![allow(clippy::print_stdout, reason = "the figures are what it is for")]

#[path = "../tests/shapes/mod.rs"]
mod shapes;

use kilauea_accel::{Accel, BuildOptions, Ray};
use kilauea_math::DAffine3;
use shapes::{Random, bumpy_sphere, placed};
use std::time::Instant;

fn main() -> Result<(), String> {
    let n_wanted: f64 = match std::env::args().nth(1) {
        None => 1e7,
        Some(n) => n.parse().map_err(|_| format!("{n}: no number"))?,
    };
    // A sphere of n rows has 4 n (n - 1) triangles.
    let mesh = bumpy_sphere((n_wanted / 4.0).sqrt().ceil() as u32 + 1);
    let start = Instant::now();
    let place = placed(0, DAffine3::IDENTITY);
    let accel = Accel::build(&[mesh.geometry()], &[place], &BuildOptions::default());
    println!(
        "{} triangles: built in {:.1} s, {:.0} MB, {} rejected",
        mesh.indices.len(),
        start.elapsed().as_secs_f64(),
        accel.n_bytes() as f64 / 1e6,
        accel.n_rejected(),
    );
    print_peak_memory();

    let start = Instant::now();
    let mut random = Random(1);
    let n_rays = 1_000_000;
    let n_leaks = (0..n_rays)
        .map(|_| Ray::new(0.3 * random.point(), random.point()))
        .filter(|ray| accel.intersect(ray).is_none())
        .count();
    let secs = start.elapsed().as_secs_f64();
    println!("{n_leaks} of {n_rays} rays got out; {secs:.1} s");

    let start = Instant::now();
    accel.validate()?;
    println!("valid: {:.1} s", start.elapsed().as_secs_f64());
    Ok(())
}

/// Highest resident size, where the system tells.
fn print_peak_memory() {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    if let Some(peak) = status.lines().find(|line| line.starts_with("VmHWM")) {
        println!("{peak}");
    }
}
