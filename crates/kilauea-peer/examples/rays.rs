//! Our rays per second beside Embree's, without Python:
//!
//! `cargo run --release -p kilauea-peer --example rays -- LIBEMBREE [ROUNDS] [FILE.mesh|FILE.rays ...]`
//!
//! A mesh is traced with the ray files that follow it; without files, the built-in shapes are.
#![allow(clippy::print_stdout, reason = "the figures are what it is for")]

use kilauea_peer::{Embree, MeasureOptions, Shape, Workload, measure, shape};
use std::error::Error;
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1).peekable();
    let library = arguments.next().ok_or("which libembree4?")?;
    let embree = Embree::load(Path::new(&library))?;
    let n_rounds = arguments.next_if(|a| a.parse::<usize>().is_ok());
    let options = MeasureOptions {
        n_rounds: n_rounds.map_or(Ok(15), |n| n.parse())?,
        build_threads: Vec::new(),
    };
    let files: Vec<PathBuf> = arguments.map(PathBuf::from).collect();
    let is_mesh = |path: &PathBuf| path.extension().is_some_and(|e| e == "mesh");
    println!("mesh                 triangles  rays           ours       peer  ratio");
    if files.is_empty() {
        for kind in Shape::ALL {
            report(&embree, &shape(kind, 1 << 17)?, &options)?;
        }
    }
    for group in files.chunk_by(|_, next| !is_mesh(next)) {
        report(&embree, &Workload::read(&group[0], &group[1..])?, &options)?;
    }
    Ok(())
}

fn report(
    embree: &Embree,
    workload: &Workload,
    options: &MeasureOptions,
) -> Result<(), Box<dyn Error>> {
    for row in measure(embree, workload, options)?.rows {
        println!(
            "{:20} {:9}  {:10} {:8.2}  {:9.2}  {:5.3}  {} / {}{}",
            row.mesh,
            row.triangles,
            row.rays,
            row.ours,
            row.peer,
            row.ratio,
            row.ours_name,
            row.peer_name,
            if row.agrees { "" } else { "  DISAGREE" },
        );
    }
    Ok(())
}
