use std::hint::black_box;
use std::time::Instant;

use crate::{RaySet, Tracer};

/// Rays that are timed together: some milliseconds' worth.
const BATCH_SIZE: usize = 4096;

/// Million rays a second of each tracer.
///
/// Tracers take turns on every batch, each round in another order, and a batch counts with its
/// best of `n_rounds`: what else the machine does falls out, and hits all alike.
pub fn mrays_per_s(tracers: &[&dyn Tracer], set: &RaySet, n_rounds: usize) -> Vec<f64> {
    let mut secs = vec![0.0; tracers.len()];
    for batch in set.rays.chunks(BATCH_SIZE) {
        let mut best = vec![f64::INFINITY; tracers.len()];
        for round in 0..n_rounds {
            for turn in 0..tracers.len() {
                let idx = (round + turn) % tracers.len();
                let start = Instant::now();
                black_box(tracers[idx].trace(black_box(batch), set.query));
                best[idx] = start.elapsed().as_secs_f64().min(best[idx]);
            }
        }
        for (sum, best) in secs.iter_mut().zip(best) {
            *sum += best;
        }
    }
    let n_rays = set.rays.len() as f64;
    secs.into_iter().map(|s| n_rays / s / 1e6).collect()
}
