//! The truth of the kernels: `cargo run --release -p kilauea-accel --example truth -- --rays 1e8`.
//!
//! Traces rays over the stress sets with both kernels, and counts what
//! is not as an oracle in `f64` says. `--set NAME` runs the sets whose names begin so; `--json FILE`
//! writes the figures. Exits with 1 if anything is wrong.
#![allow(clippy::print_stdout, reason = "the figures are what it is for")]

mod suite;

use serde_json::{Value, json};
use std::process::ExitCode;
use std::time::Instant;
use suite::{Tally, all_sets, run};

fn main() -> ExitCode {
    match measure() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

/// Whether all sets are clean.
fn measure() -> Result<bool, String> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let option = |name: &str| {
        let found = arguments.iter().position(|argument| argument == name)?;
        Some(arguments.get(found + 1).map_or("", String::as_str))
    };
    let n_rays = option("--rays").unwrap_or("1e6");
    let n_rays: f64 = n_rays
        .parse()
        .map_err(|_| format!("--rays {n_rays}: no number"))?;
    let mut sets = all_sets();
    if let Some(name) = option("--set") {
        sets.retain(|set| set.name.starts_with(name));
    }
    if sets.is_empty() {
        return Err("--set: no set begins so".to_owned());
    }

    let per_set = (n_rays / sets.len() as f64) as u64;
    println!(
        "{:16} {:>10} {:>10}  leaks missed false wrong  self kernels  t error   off by     s",
        "set", "rays", "spawned"
    );
    let mut rows = Vec::new();
    let mut is_clean = true;
    for set in &sets {
        let start = Instant::now();
        let tally = run(set, per_set);
        let secs = start.elapsed().as_secs_f64();
        print_row(&set.name, &tally, secs);
        rows.push(row(&set.name, &tally, secs));
        is_clean &= tally.is_clean();
    }
    if let Some(file) = option("--json") {
        let text = format!("{:#}\n", Value::from(rows));
        std::fs::write(file, text).map_err(|error| format!("{file}: {error}"))?;
    }
    Ok(is_clean)
}

fn print_row(name: &str, tally: &Tally, secs: f64) {
    println!(
        "{name:16} {:10} {:10} {:6} {:6} {:5} {:5} {:5} {:7}  {:.1e}  {:7.2}  {secs:4.0}",
        tally.n_rays,
        tally.n_spawned,
        tally.n_leaks,
        tally.n_missed,
        tally.n_false,
        tally.n_wrong,
        tally.n_self,
        tally.n_kernels,
        tally.max_t_error,
        tally.max_off_by,
    );
    for failure in &tally.failures {
        println!("    {failure}");
    }
}

fn row(name: &str, tally: &Tally, secs: f64) -> Value {
    json!({
        "set": name,
        "rays": tally.n_rays,
        "spawned": tally.n_spawned,
        "leaks": tally.n_leaks,
        "missed": tally.n_missed,
        "false": tally.n_false,
        "wrong": tally.n_wrong,
        "self": tally.n_self,
        "kernels_differ": tally.n_kernels,
        "max_t_error": tally.max_t_error,
        "max_off_by_ulps": tally.max_off_by,
        "failures": tally.failures,
        "seconds": secs,
    })
}
