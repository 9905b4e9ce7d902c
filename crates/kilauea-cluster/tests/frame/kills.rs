//! Workers that are killed at random moments.

use std::thread::sleep;
use std::time::Duration;

use kilauea_cluster::ClusterJob;
use kilauea_math::hash::{mix32, unit_f32};

use super::{signal, wait_for_progress};

/// Time in which a worker is killed before any result has to be there, in seconds: about what its
/// process, the scene, and what paths know beforehand take.
const BEGINNING_SECS: f64 = 0.4;

/// How often a worker is killed for each way of rendering: `KILAUEA_KILLS`, or twice.
pub(crate) fn n_kills() -> u32 {
    let asked = std::env::var("KILAUEA_KILLS");
    asked.ok().and_then(|n| n.parse().ok()).unwrap_or(2)
}

/// Kills a worker at a random moment: for even seeds in the beginning of a frame, for odd ones
/// while its image is rendered.
pub(crate) fn kill_one(job: &ClusterJob, seed: u32) {
    let random = |i: u32| f64::from(unit_f32(mix32(mix32(seed) ^ i)));
    if seed.is_multiple_of(2) {
        sleep(Duration::from_secs_f64(BEGINNING_SECS * random(1)));
    } else {
        wait_for_progress(job, 0.8 * random(1));
        sleep(Duration::from_secs_f64(0.05 * random(2)));
    }
    let pids = job.worker_pids();
    if let Some(&pid) = pids.get((random(3) * pids.len() as f64) as usize) {
        signal("KILL", pid);
    }
}
