//! Frames by the clock, and what they tell the simulator.
#![allow(dead_code, reason = "each example uses a part")]

use std::error::Error;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::time::{Duration, Instant};

use kilauea_cluster::protocol::{Expected, HEADER_BYTES, Header, Message, UnitDone};
use kilauea_cluster::{ClusterJob, ClusterOptions, ClusterResult, Ticket};
use kilauea_scene::{RenderSettings, Scene};
use kilauea_sim::UnitCost;
use kilauea_tests::{Stage, rect_light};
use serde::Serialize;

pub(crate) type Outcome<T> = Result<T, Box<dyn Error>>;

/// What is rendered.
pub(crate) struct Shot {
    pub(crate) scene: Scene,
    pub(crate) settings: RenderSettings,
}

/// What a frame of one worker without a network tells.
pub(crate) struct Measured {
    pub(crate) units: Vec<UnitCost>,
    pub(crate) secs_per_ray: f64,
    pub(crate) prepare_secs: f64,
}

/// A unit of a frame.
pub(crate) struct UnitShare {
    n_rays: f64,
    result_bytes: f64,
}

/// What frames of one kind took, beside what the simulator says.
#[derive(Serialize)]
pub(crate) struct Row {
    /// A second, on each link either way; 0 is as fast as can be.
    #[serde(rename = "megabytes_per_sec")]
    pub(crate) megabytes: f64,
    /// One way.
    pub(crate) delay_ms: f64,
    #[serde(rename = "workers")]
    pub(crate) n_workers: usize,
    pub(crate) seconds: f64,
    pub(crate) predicted: f64,
}

/// A frame, from its start to its last result.
pub(crate) struct Timed {
    pub(crate) seconds: f64,
    pub(crate) result: ClusterResult,
}

impl Shot {
    /// A ball on a floor: 64 tiles of 160 KB, which is what all layers take.
    pub(crate) fn ball_on_floor() -> Self {
        let mut stage = Stage::sphere_on_floor();
        stage.lights.push(rect_light(0.5, 0.5, 2.0));
        let settings = RenderSettings {
            resolution: [256, 256],
            samples_per_pixel: 2,
            threads: 1,
            ..Stage::settings()
        };
        Self {
            scene: stage.scene(settings.resolution),
            settings,
        }
    }

    /// Renders with workers that `start` brings up.
    pub(crate) fn render(
        &self,
        options: ClusterOptions,
        start: &mut dyn FnMut(Ticket) -> Outcome<()>,
    ) -> Outcome<Timed> {
        let options = ClusterOptions {
            tls: false,
            dead_after: Duration::from_mins(5),
            suspect_after: Duration::from_mins(5),
            ..options
        };
        let job = ClusterJob::start(&self.scene, &self.settings, options)?;
        let mut begun = None;
        let mut seconds = 0.0;
        while !job.wait(Duration::from_micros(500)) {
            for ticket in job.take_tickets() {
                begun = begun.or_else(|| Some(Instant::now()));
                start(ticket)?;
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

    /// What units cost one worker, by the fastest of some frames. Seconds go to units by their rays.
    pub(crate) fn measure(
        &self,
        options: &ClusterOptions,
        n_runs: usize,
        start: &mut dyn FnMut(Ticket) -> Outcome<()>,
    ) -> Outcome<Measured> {
        let (mut best, mut shares) = self.render_units(options, start)?;
        for _ in 1..n_runs {
            let (timed, its) = self.render_units(options, start)?;
            if working_secs(&timed) < working_secs(&best) {
                (best, shares) = (timed, its);
            }
        }
        let n_rays: f64 = shares.iter().map(|unit| unit.n_rays).sum();
        let secs_per_ray = working_secs(&best) / n_rays;
        Ok(Measured {
            units: shares.iter().map(|unit| unit.cost(secs_per_ray)).collect(),
            secs_per_ray,
            prepare_secs: best.result.frame.stats.times.build,
        })
    }

    /// Renders, and tells what units there were.
    pub(crate) fn render_units(
        &self,
        options: &ClusterOptions,
        start: &mut dyn FnMut(Ticket) -> Outcome<()>,
    ) -> Outcome<(Timed, Vec<UnitShare>)> {
        let path = std::env::temp_dir().join(format!("kilauea-measured-{}", std::process::id()));
        let options = ClusterOptions {
            journal: Some(path.clone()),
            ..options.clone()
        };
        let timed = self.render(options, start)?;
        let units = read_journal(&path)?;
        std::fs::remove_file(&path)?;
        Ok((timed, units))
    }
}

impl UnitShare {
    pub(crate) fn cost(&self, secs_per_ray: f64) -> UnitCost {
        UnitCost {
            secs: self.n_rays * secs_per_ray,
            result_bytes: self.result_bytes,
        }
    }
}

impl Row {
    /// Tells what there is already: all of it takes minutes.
    pub(crate) fn told(self) -> Self {
        let Self {
            megabytes,
            delay_ms,
            n_workers,
            seconds,
            predicted,
        } = self;
        eprintln!(
            "{megabytes} MB/s, {delay_ms} ms, {n_workers} workers: {seconds:.3} s, \
             predicted {predicted:.3} s, {:+.1} %",
            100.0 * (predicted / seconds - 1.0)
        );
        self
    }
}

/// Prints what `pipeline/plot_replicas.py` and others read.
pub(crate) fn print(rows: &[Row]) -> Outcome<()> {
    println!("{}", serde_json::to_string_pretty(rows)?);
    Ok(())
}

/// What simulators are told of a link.
pub(crate) fn bytes_per_sec(megabytes: f64) -> f64 {
    if megabytes > 0.0 {
        1e6 * megabytes
    } else {
        f64::INFINITY
    }
}

/// From when a worker could render to its last result, by who took longest.
pub(crate) fn working_secs(timed: &Timed) -> f64 {
    let workers = timed.result.workers.iter();
    workers
        .map(|worker| worker.working_secs)
        .fold(0.0, f64::max)
}

/// The units in a journal, in the order in which they were done.
fn read_journal(path: &Path) -> Outcome<Vec<UnitShare>> {
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
            units.push(UnitShare {
                n_rays: done.tally.n_rays() as f64,
                result_bytes: n_bytes as f64,
            });
        }
        number += 1;
    }
    Ok(units)
}
