//! Hundreds of frames while workers die, hang, and lose touch: the same pixels each time, and no more
//! memory at the end than after the first few.

#![allow(clippy::print_stdout, reason = "what a long run shows while it runs")]

mod chaos;
mod frame;

use std::fs;
use std::time::{Duration, Instant};

use chaos::{Direction, Passage, Proxy, Way};
use frame::elsewhere::{open_options, start_through};
use frame::{Shot, processes, signal};
use kilauea_cluster::{ClusterJob, ClusterOptions, ClusterResult};
use kilauea_math::hash::mix64;

const N_FRAMES: u64 = 200;
/// After which memory has grown to what a frame takes.
const N_WARM_UP: u64 = 40;
/// Of memory that may come from where a frame happens to be when it is looked at.
const MAX_GROWTH_BYTES: f64 = 16e6;

/// Random numbers of a frame.
struct Chance(u64);

impl Chance {
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_add(1);
        mix64(self.0.wrapping_mul(0x9e37_79b9_7f4a_7c15)) % n
    }

    fn millis(&mut self, most: u64) -> Duration {
        Duration::from_millis(self.below(most))
    }
}

fn options(options: ClusterOptions) -> ClusterOptions {
    ClusterOptions {
        max_restarts: 1000,
        suspect_after: Duration::from_millis(500),
        dead_after: Duration::from_secs(1),
        patience: Duration::from_millis(500),
        ..options
    }
}

/// Processes, of which some are killed and some stopped for a while.
fn with_signals(shot: &Shot, chance: &mut Chance) -> ClusterResult {
    let job = shot.start(options(frame::options(3, processes())));
    while !job.wait(chance.millis(120)) {
        let pids = job.worker_pids();
        let Some(&pid) = pids.get(chance.below(8) as usize) else {
            continue;
        };
        if chance.below(2) == 0 {
            signal("KILL", pid);
        } else {
            signal("STOP", pid);
        }
    }
    // Those that are stopped end with the job.
    finish(job)
}

/// Threads behind proxies that part, cut, slow and damage.
fn with_networks(shot: &Shot, chance: &mut Chance) -> ClusterResult {
    let job = shot.start(options(open_options(3)));
    let (mut proxies, mut workers) = (Vec::<Proxy>::new(), Vec::new());
    while !job.wait(chance.millis(60)) {
        for ticket in job.take_tickets() {
            let (epoch, proxy) = (ticket.epoch, Proxy::new(&ticket.address));
            workers.push((epoch, start_through(proxy.address(), ticket)));
            proxies.push(proxy);
        }
        // Whoever starts workers says which have ended: one that was cut off before it joined would be
        // waited for.
        workers.retain(|(epoch, worker)| {
            if worker.is_finished() {
                job.worker_ended(*epoch, "it has ended".into());
            }
            !worker.is_finished()
        });
        let Some(proxy) = proxies.get(chance.below(proxies.len() as u64 + 4) as usize) else {
            continue;
        };
        let direction = [Direction::ToConsole, Direction::ToWorker][chance.below(2) as usize];
        let way = Way::default();
        match chance.below(6) {
            0 => proxy.cut(),
            1 => proxy.set(
                direction,
                Way {
                    passage: Passage::Stalled,
                    ..way
                },
            ),
            2 => proxy.set(
                direction,
                Way {
                    bytes_per_sec: Some(1e6),
                    ..way
                },
            ),
            3 => proxy.set(
                direction,
                Way {
                    flip_at: Some(1000 + chance.below(200_000)),
                    ..way
                },
            ),
            _ => proxy.set_both(&way),
        }
    }
    finish(job)
}

/// Fails where the frame ends with units that somebody still holds, as of its ledger.
fn finish(job: ClusterJob) -> ClusterResult {
    let units = job.snapshot().units;
    assert_eq!(units.n_done, units.n_units, "{units:?}");
    job.finish().expect("others render it")
}

/// Resident size of this process.
fn rss_bytes() -> f64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kib = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    kib.expect("Linux says how large a process is") * 1024.0
}

/// Slope of a line through values at 0, 1, 2, …, by least squares.
fn slope(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let (mean_x, mean_y) = ((n - 1.0) / 2.0, values.iter().sum::<f64>() / n);
    let sums = (values.iter().zip(0..)).fold((0.0, 0.0), |(xy, xx), (y, i)| {
        let x = f64::from(i) - mean_x;
        (xy + x * (y - mean_y), xx + x * x)
    });
    sums.0 / sums.1
}

#[test]
#[ignore = "takes minutes"]
fn hundreds_of_frames_in_bad_weather() {
    let shot = Shot::new();
    let alone = shot.alone();
    let begun = Instant::now();
    let (mut n_lost, mut n_lent_again, mut n_stale) = (0, 0, 0);
    let mut sizes = Vec::new();
    for seed in 0..N_FRAMES {
        let mut chance = Chance(seed << 32);
        let result = if seed % 2 == 0 {
            with_signals(&shot, &mut chance)
        } else {
            with_networks(&shot, &mut chance)
        };
        shot.check(&alone, &result, &format!("frame {seed}"));
        n_lost += result.workers.iter().filter(|w| w.lost.is_some()).count();
        n_lent_again += result.units.n_lent_again;
        n_stale += result.network.stale_messages;
        if seed >= N_WARM_UP {
            sizes.push(rss_bytes());
        }
        if seed % 20 == 19 {
            println!(
                "{} frames, {:.0} s, {n_lost} workers lost, {n_lent_again} units lent again, \
                 {n_stale} frames of the dead, {:.1} MB",
                seed + 1,
                begun.elapsed().as_secs_f64(),
                rss_bytes() / 1e6
            );
        }
    }
    assert!(n_lost > 20, "nothing much happened: {n_lost}");
    let growth = slope(&sizes) * sizes.len() as f64;
    println!("memory grows by {:.1} kB a frame", slope(&sizes) / 1e3);
    assert!(growth < MAX_GROWTH_BYTES, "{growth} bytes more");
}
