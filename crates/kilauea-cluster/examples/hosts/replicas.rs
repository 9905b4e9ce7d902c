//! Workers that hold the whole scene.

use std::path::Path;

use kilauea_cluster::{ClusterOptions, WorkerKind, scene_to_bytes};
use kilauea_sim::{ReplicaLink, ReplicaModel};

use crate::Asked;
use crate::measured::{Outcome, Row, Shot, bytes_per_sec};
use crate::namespaces::{CONSOLE, Hosts};

/// Connecting, then the challenge and the two hellos.
const N_ROUND_TRIPS: f64 = 1.0;
/// Megabytes a second of each host; 0 is as fast as can be.
const NETWORKS: [f64; 3] = [0.0, 4.0, 1.0];

pub(crate) fn rows(asked: &Asked) -> Outcome<Vec<Row>> {
    let mut shot = Shot::ball_on_floor();
    shot.settings.samples_per_pixel = 16;
    let mut hosts = Hosts::new(1, 0.0)?;
    let measured = shot.measure(&options(1), asked.n_runs, &mut |ticket| {
        hosts.start(0, &asked.worker, &ticket)
    })?;
    drop(hosts);
    let mut rows = Vec::new();
    for &n_hosts in &asked.n_hosts {
        // The more workers there are, the smaller are units.
        let mut hosts = Hosts::new(n_hosts, 0.0)?;
        let (_, units) = shot.render_units(&options(n_hosts), &mut |ticket| {
            hosts.start(ticket.rank as usize, &asked.worker, &ticket)
        })?;
        drop(hosts);
        let units = units.iter().map(|unit| unit.cost(measured.secs_per_ray));
        let units: Vec<_> = units.collect();
        for megabytes in NETWORKS {
            let link = ReplicaLink {
                bytes_per_sec: bytes_per_sec(megabytes),
                delay_secs: 0.0,
            };
            let model = ReplicaModel {
                links: vec![link; n_hosts],
                n_threads: 1,
                cores: asked.n_cores as f64,
                units: units.clone(),
                scene_bytes: scene_to_bytes(&shot.scene).len() as f64,
                prepare_secs: measured.prepare_secs,
                n_round_trips: N_ROUND_TRIPS,
            };
            let mut seconds = f64::INFINITY;
            for _ in 0..asked.n_runs {
                seconds = seconds.min(render(&shot, n_hosts, megabytes, &asked.worker)?);
            }
            let row = Row {
                megabytes,
                delay_ms: 0.0,
                n_workers: n_hosts,
                seconds,
                predicted: model.frame().seconds,
            };
            rows.push(row.told());
        }
    }
    Ok(rows)
}

fn options(n_workers: usize) -> ClusterOptions {
    ClusterOptions::new(n_workers as u32, WorkerKind::Elsewhere { host: CONSOLE })
}

fn render(shot: &Shot, n_hosts: usize, megabytes: f64, worker: &Path) -> Outcome<f64> {
    let mut hosts = Hosts::new(n_hosts, 1e6 * megabytes)?;
    let timed = shot.render(options(n_hosts), &mut |ticket| {
        hosts.start(ticket.rank as usize, worker, &ticket)
    })?;
    hosts.wait()?;
    Ok(timed.seconds)
}
