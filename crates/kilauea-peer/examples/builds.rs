//! Seconds of our builds beside Embree's, without Python:
//!
//! `cargo run --release -p kilauea-peer --example builds -- LIBEMBREE [ROUNDS] FILE.mesh ...`
//!
//! Every round builds each tree on one and on two threads, and the best counts: what else the
//! machine does falls out, if it rests now and then.
#![allow(clippy::print_stdout, reason = "the figures are what it is for")]

use kilauea_peer::{BuildRow, Embree, Workload};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1).peekable();
    let library = arguments.next().ok_or("which libembree4?")?;
    let embree = Embree::load(Path::new(&library))?;
    let n_rounds = arguments.next_if(|a| a.parse::<usize>().is_ok());
    let n_rounds: usize = n_rounds.map_or(Ok(3), |n| n.parse())?;
    println!("mesh                 triangles  builder               one     two  ratio  bytes");
    for file in arguments {
        let workload = Workload::read(Path::new(&file), &[])?;
        let [mut one, mut two] = rows(&embree, &workload)?;
        for _ in 1..n_rounds {
            let [again_one, again_two] = rows(&embree, &workload)?;
            keep_best(&mut one, &again_one);
            keep_best(&mut two, &again_two);
        }
        for (one, two) in one.iter().zip(&two) {
            println!(
                "{:20} {:9}  {:20} {:.3}  {:.3}  {:5.2}  {:5.1}",
                one.mesh,
                one.triangles,
                one.builder,
                one.seconds,
                two.seconds,
                one.seconds / two.seconds,
                one.bytes_per_triangle,
            );
        }
    }
    Ok(())
}

/// Builds on one and on two threads.
fn rows(embree: &Embree, workload: &Workload) -> Result<[Vec<BuildRow>; 2], Box<dyn Error>> {
    let one = BuildRow::of_all(embree, workload, 1)?;
    Ok([one, BuildRow::of_all(embree, workload, 2)?])
}

fn keep_best(best: &mut [BuildRow], again: &[BuildRow]) {
    for (best, again) in best.iter_mut().zip(again) {
        best.seconds = best.seconds.min(again.seconds);
    }
}
