//! Feeds damaged bytes to all decoders in turns:
//! `cargo run -p kilauea-cluster --example fuzz -- --seconds 3600 [--seed N] [--target NAME]`.
//!
//! Ends with an error where one panicked or took more memory than it may, and writes what made it do
//! so into `fuzz-NAME-N.bin`. Without `--release`, so that sums that overflow are noticed. Guided by how
//! inputs end, as a stable compiler tells nothing of the way there.
#![allow(clippy::print_stdout, reason = "a command")]

#[path = "../tests/fuzzing/mod.rs"]
mod fuzzing;

use std::time::{Duration, Instant};

use fuzzing::{Fuzzer, targets};

/// How long each target is tried at a time.
const TURN: Duration = Duration::from_secs(1);
/// Inputs between two looks at the clock.
const ROUND: u64 = 64;
/// How often figures are printed.
const PRINT_EVERY: Duration = Duration::from_mins(5);

struct Options {
    seconds: u64,
    seed: u64,
    target: Option<String>,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let options = options(std::env::args().skip(1))?;
    let is_wanted = |name: &str| options.target.as_deref().is_none_or(|t| t == name);
    let mut fuzzers: Vec<Fuzzer> = (targets().into_iter())
        .filter(|target| is_wanted(target.name))
        .map(|target| Fuzzer::new(target, options.seed))
        .collect();
    if fuzzers.is_empty() {
        return Err("there is no such target".into());
    }
    let start = Instant::now();
    let end = Duration::from_secs(options.seconds);
    let mut printed = Instant::now();
    while start.elapsed() < end {
        for fuzzer in &mut fuzzers {
            let turn = Instant::now();
            while turn.elapsed() < TURN && start.elapsed() < end {
                fuzzer.run(ROUND);
            }
        }
        if printed.elapsed() > PRINT_EVERY {
            printed = Instant::now();
            print(&fuzzers, start.elapsed());
        }
    }
    print(&fuzzers, start.elapsed());
    let n_faults = write_faults(&fuzzers)?;
    match n_faults {
        0 => Ok(()),
        n => Err(format!("{n} faults").into()),
    }
}

fn options(mut args: impl Iterator<Item = String>) -> Result<Options, Box<dyn std::error::Error>> {
    let mut options = Options {
        seconds: 60,
        seed: 1,
        target: None,
    };
    while let Some(flag) = args.next() {
        let value = args.next().ok_or_else(|| format!("{flag} of what?"))?;
        match flag.as_str() {
            "--seconds" => options.seconds = value.parse()?,
            "--seed" => options.seed = value.parse()?,
            "--target" => options.target = Some(value),
            _ => return Err(format!("unknown flag {flag}").into()),
        }
    }
    Ok(options)
}

fn print(fuzzers: &[Fuzzer], elapsed: Duration) {
    println!("after {} s:", elapsed.as_secs());
    for Fuzzer {
        target, findings, ..
    } in fuzzers
    {
        println!(
            "  {:10} {:>12} inputs, {:>11} read, {:>4} outcomes, {:>6.2} MB at most, {} faults",
            target.name,
            findings.n_inputs,
            findings.n_read,
            findings.n_outcomes,
            findings.peak_bytes as f64 / 1e6,
            findings.faults.len()
        );
    }
}

/// Writes the first inputs of each target that did harm; how many there were.
fn write_faults(fuzzers: &[Fuzzer]) -> std::io::Result<usize> {
    let mut n_faults = 0;
    for fuzzer in fuzzers {
        let (name, faults) = (fuzzer.target.name, &fuzzer.findings.faults);
        n_faults += faults.len();
        for (i, (fault, input)) in faults.iter().take(10).enumerate() {
            let file = format!("fuzz-{}-{i}.bin", name.replace(' ', "-"));
            std::fs::write(&file, input)?;
            println!("{name}: {fault}: {file}");
        }
    }
    Ok(n_faults)
}
