//! Frames of one to three workers on slow networks, beside what `kilauea-sim` says they take:
//! `cargo run -p kilauea-cluster --example replicas -- [RUNS] > replicas.json`.
//!
//! Workers have one thread each and reach the console through the proxy of the tests, which delays and
//! throttles their bytes. The simulator is told what units cost, which it gets from the frame of one
//! worker without a proxy: rays and bytes of each unit from its journal, and seconds for all of them.
//! Of RUNS frames of each kind, by turns, the fastest counts: what else the machine does only slows
//! them down.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command")]

#[path = "../tests/chaos/mod.rs"]
mod chaos;
mod measured;

use std::net::{IpAddr, Ipv4Addr};
use std::thread;
use std::time::Duration;

use chaos::{Proxy, Way};
use kilauea_cluster::{ClusterOptions, Ticket, WorkerKind, run_worker_for, scene_to_bytes};
use kilauea_sim::{ReplicaLink, ReplicaModel};
use measured::{Outcome, Row, Shot, bytes_per_sec};

/// Megabytes a second and milliseconds one way; 0 for a network that does not matter.
const NETWORKS: [(f64, f64); 5] = [(0.0, 0.0), (4.0, 0.0), (1.0, 0.0), (0.0, 50.0), (2.0, 20.0)];
const MOST_WORKERS: usize = 3;
/// Connecting to the proxy and from there, then the challenge and the two hellos.
const N_ROUND_TRIPS: f64 = 1.0;

fn main() -> Outcome<()> {
    let n_runs: usize = std::env::args().nth(1).map_or(Ok(3), |runs| runs.parse())?;
    let shot = Shot::ball_on_floor();
    let measured = shot.measure(&options(1), n_runs, &mut |ticket| {
        thread::spawn(move || run_worker_for(&ticket));
        Ok(())
    })?;
    let scene_bytes = scene_to_bytes(&shot.scene).len() as f64;
    let total: f64 = measured.units.iter().map(|unit| unit.secs).sum();
    eprintln!(
        "{} units, {total:.2} s; prepared in {:.3} s; scene of {scene_bytes} bytes",
        measured.units.len(),
        measured.prepare_secs
    );
    let mut rows = Vec::new();
    for (megabytes, delay_ms) in NETWORKS {
        for n_workers in 1..=MOST_WORKERS {
            let link = link(megabytes, delay_ms);
            let model = ReplicaModel {
                links: vec![link; n_workers],
                n_threads: 1,
                cores: thread::available_parallelism()?.get() as f64,
                units: measured.units.clone(),
                scene_bytes,
                prepare_secs: measured.prepare_secs,
                n_round_trips: N_ROUND_TRIPS,
            };
            let mut seconds = f64::INFINITY;
            for _ in 0..n_runs {
                seconds = seconds.min(render(&shot, n_workers, link)?);
            }
            let row = Row {
                megabytes,
                delay_ms,
                n_workers,
                seconds,
                predicted: model.frame().seconds,
            };
            rows.push(row.told());
        }
    }
    measured::print(&rows)
}

fn options(n_workers: usize) -> ClusterOptions {
    let host = IpAddr::V4(Ipv4Addr::LOCALHOST);
    ClusterOptions::new(n_workers as u32, WorkerKind::Elsewhere { host })
}

fn link(megabytes: f64, delay_ms: f64) -> ReplicaLink {
    ReplicaLink {
        bytes_per_sec: bytes_per_sec(megabytes),
        delay_secs: 1e-3 * delay_ms,
    }
}

/// Renders a frame over links and returns its seconds.
fn render(shot: &Shot, n_workers: usize, link: ReplicaLink) -> Outcome<f64> {
    let mut proxies = Vec::new();
    let mut start = |mut ticket: Ticket| {
        let proxy = Proxy::new(&ticket.address);
        proxy.set_both(&Way {
            delay: Duration::from_secs_f64(link.delay_secs),
            bytes_per_sec: link.bytes_per_sec.is_finite().then_some(link.bytes_per_sec),
            ..Way::default()
        });
        ticket.address = proxy.address();
        proxies.push(proxy);
        thread::spawn(move || run_worker_for(&ticket));
        Ok(())
    };
    Ok(shot.render(options(n_workers), &mut start)?.seconds)
}
