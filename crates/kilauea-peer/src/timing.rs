use std::hint::black_box;
use std::time::Instant;

use crate::{RaySet, Tracer};

/// Rays that are timed together: a millisecond's worth or two.
const BATCH_SIZE: usize = 4096;

/// Million rays a second of each tracer.
///
/// In every round each batch of rays goes through all tracers, in an order that changes from round
/// to round, and each tracer's best time for each batch counts. What else the machine does falls
/// out, if it rests now and then, and hits all alike where it does not.
pub fn mrays_per_s(tracers: &[&dyn Tracer], set: &RaySet, n_rounds: usize) -> Vec<f64> {
    let batches: Vec<_> = set.rays.chunks(BATCH_SIZE).collect();
    let mut best_secs = vec![vec![f64::INFINITY; batches.len()]; tracers.len()];
    for round in 0..n_rounds {
        for (batch_idx, batch) in batches.iter().enumerate() {
            for turn in 0..tracers.len() {
                let idx = (round + turn) % tracers.len();
                let start = Instant::now();
                black_box(tracers[idx].trace(black_box(batch), set.query));
                let secs = start.elapsed().as_secs_f64();
                best_secs[idx][batch_idx] = secs.min(best_secs[idx][batch_idx]);
            }
        }
    }
    let n_rays = set.rays.len() as f64;
    let rate = |best: &Vec<f64>| n_rays / best.iter().sum::<f64>() / 1e6;
    best_secs.iter().map(rate).collect()
}
