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

use std::error::Error;
use std::fs::File;
use std::io::Read;
use std::net::{IpAddr, Ipv4Addr};
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use chaos::{Proxy, Way};
use kilauea_cluster::protocol::{Expected, HEADER_BYTES, Header, Message, UnitDone};
use kilauea_cluster::{
    ClusterJob, ClusterOptions, ClusterResult, WorkerKind, run_worker_for, scene_to_bytes,
};
use kilauea_scene::{RenderSettings, Scene};
use kilauea_sim::{ReplicaLink, ReplicaModel, UnitCost};
use kilauea_tests::{Stage, rect_light};
use serde_json::json;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Megabytes a second and milliseconds one way; 0 for a network that does not matter.
const NETWORKS: [(f64, f64); 5] = [(0.0, 0.0), (4.0, 0.0), (1.0, 0.0), (0.0, 50.0), (2.0, 20.0)];
const MOST_WORKERS: usize = 3;
/// Connecting to the proxy and from there, then the challenge and the two hellos.
const N_ROUND_TRIPS: f64 = 1.0;

/// What is rendered.
struct Shot {
    scene: Scene,
    settings: RenderSettings,
}

/// What a frame of one worker without a network tells.
struct Measured {
    units: Vec<UnitCost>,
    prepare_secs: f64,
}

/// A frame, from its start to its last result.
struct Timed {
    seconds: f64,
    result: ClusterResult,
}

fn main() -> Outcome<()> {
    let n_runs: usize = std::env::args().nth(1).map_or(Ok(3), |runs| runs.parse())?;
    let shot = shot();
    let measured = measure(&shot, n_runs)?;
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
                seconds = seconds.min(render(&shot, n_workers, Some(link), None)?.seconds);
            }
            let predicted = model.frame().seconds;
            eprintln!(
                "{megabytes} MB/s, {delay_ms} ms, {n_workers} workers: {seconds:.3} s, \
                 predicted {predicted:.3} s, {:+.1} %",
                100.0 * (predicted / seconds - 1.0)
            );
            rows.push(json!({
                "megabytes_per_sec": megabytes,
                "delay_ms": delay_ms,
                "workers": n_workers,
                "seconds": seconds,
                "predicted": predicted,
            }));
        }
    }
    println!("{}", serde_json::to_string_pretty(&rows)?);
    Ok(())
}

/// A ball on a floor: 64 tiles of 160 KB, which is what all layers take.
fn shot() -> Shot {
    let mut stage = Stage::sphere_on_floor();
    stage.lights.push(rect_light(0.5, 0.5, 2.0));
    let settings = RenderSettings {
        resolution: [256, 256],
        samples_per_pixel: 2,
        threads: 1,
        ..Stage::settings()
    };
    Shot {
        scene: stage.scene(settings.resolution),
        settings,
    }
}

fn link(megabytes: f64, delay_ms: f64) -> ReplicaLink {
    ReplicaLink {
        bytes_per_sec: if megabytes > 0.0 {
            1e6 * megabytes
        } else {
            f64::INFINITY
        },
        delay_secs: 1e-3 * delay_ms,
    }
}

/// Renders with one worker and no proxy. Seconds go to units by their rays.
fn measure(shot: &Shot, n_runs: usize) -> Outcome<Measured> {
    let path = std::env::temp_dir().join(format!("kilauea-replicas-{}", std::process::id()));
    let (mut best, mut rays_and_bytes) = (None::<Timed>, Vec::new());
    for _ in 0..n_runs {
        let timed = render(shot, 1, None, Some(&path))?;
        rays_and_bytes = read_journal(&path)?;
        std::fs::remove_file(&path)?;
        let is_best = |best: &Timed| working_secs(&timed) < working_secs(best);
        if best.as_ref().is_none_or(is_best) {
            best = Some(timed);
        }
    }
    let best = best.ok_or("no runs")?;
    let n_rays: f64 = rays_and_bytes.iter().map(|(rays, _)| rays).sum();
    let secs_per_ray = working_secs(&best) / n_rays;
    let unit = |&(rays, result_bytes): &(f64, f64)| UnitCost {
        secs: rays * secs_per_ray,
        result_bytes,
    };
    Ok(Measured {
        units: rays_and_bytes.iter().map(unit).collect(),
        prepare_secs: best.result.frame.stats.times.build,
    })
}

/// From when the only worker could render to its last result.
fn working_secs(timed: &Timed) -> f64 {
    timed.result.workers[0].working_secs
}

/// Rays and bytes of the units in a journal, which one worker has done in the order of their leases.
fn read_journal(path: &Path) -> Outcome<Vec<(f64, f64)>> {
    let mut file = File::open(path)?;
    let mut units = Vec::new();
    let mut head = [0; HEADER_BYTES];
    let mut number = 0;
    while file.read_exact(&mut head).is_ok() {
        let expected = Expected {
            session: None,
            number,
            max_body_bytes: u32::MAX,
        };
        let header = Header::parse(&head, &expected)?;
        let mut body = vec![0; header.n_body_bytes()];
        file.read_exact(&mut body)?;
        let frame = header.with_body(body)?;
        if number > 0 {
            let (done, _) = UnitDone::read(&frame)?;
            let n_bytes = HEADER_BYTES + frame.body.len();
            units.push((done.tally.n_rays() as f64, n_bytes as f64));
        }
        number += 1;
    }
    Ok(units)
}

fn render(
    shot: &Shot,
    n_workers: usize,
    link: Option<ReplicaLink>,
    journal: Option<&Path>,
) -> Outcome<Timed> {
    let host = IpAddr::V4(Ipv4Addr::LOCALHOST);
    let options = ClusterOptions {
        tls: false,
        journal: journal.map(Into::into),
        dead_after: Duration::from_mins(5),
        suspect_after: Duration::from_mins(5),
        ..ClusterOptions::new(n_workers as u32, WorkerKind::Elsewhere { host })
    };
    let job = ClusterJob::start(&shot.scene, &shot.settings, options)?;
    let mut proxies = Vec::new();
    let mut begun = None;
    let mut seconds = 0.0;
    while !job.wait(Duration::from_micros(500)) {
        for mut ticket in job.take_tickets() {
            if let Some(link) = link {
                let proxy = Proxy::new(&ticket.address);
                proxy.set_both(&Way {
                    delay: Duration::from_secs_f64(link.delay_secs),
                    bytes_per_sec: link.bytes_per_sec.is_finite().then_some(link.bytes_per_sec),
                    ..Way::default()
                });
                ticket.address = proxy.address();
                proxies.push(proxy);
            }
            begun = begun.or_else(|| Some(Instant::now()));
            thread::spawn(move || run_worker_for(&ticket));
        }
        let Some(begun) = begun else { continue };
        if job.progress().0 < 1.0 {
            seconds = begun.elapsed().as_secs_f64();
        }
    }
    Ok(Timed {
        seconds,
        result: job.finish()?,
    })
}
