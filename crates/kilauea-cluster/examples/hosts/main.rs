//! Frames on hosts behind links of given speeds, beside what `kilauea-sim` says they take:
//!
//! ```sh
//! cargo build --release -p kilauea-cluster --bin kilauea-worker
//! cargo run --release -p kilauea-cluster --example hosts -- KIND WORKER RUNS HOSTS… > rows.json
//! ```
//!
//! KIND is `replicas`, where each host has the whole scene, or `sets`, where all of them are one; WORKER
//! is the program that was built. Hosts are network namespaces of this machine, with a core each as long
//! as there are enough. Of RUNS frames of each kind the fastest counts. Needs root and iproute2.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command")]

#[path = "../measured/mod.rs"]
mod measured;
mod namespaces;
mod replicas;
mod sets;
#[path = "../spread_stage/mod.rs"]
mod spread_stage;

use std::path::PathBuf;

use measured::Outcome;
use serde_json::json;

/// What is asked for.
pub(crate) struct Asked {
    pub(crate) worker: PathBuf,
    pub(crate) n_runs: usize,
    pub(crate) n_hosts: Vec<usize>,
    pub(crate) n_cores: usize,
}

/// Frames of one kind.
pub(crate) struct Row {
    /// A second, of each host either way; 0 is as fast as can be.
    pub(crate) megabytes: f64,
    pub(crate) n_hosts: usize,
    pub(crate) seconds: f64,
    pub(crate) predicted: f64,
}

fn main() -> Outcome<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [kind, worker, n_runs, n_hosts @ ..] = &arguments[..] else {
        return Err("KIND, WORKER, RUNS and HOSTS are missing".into());
    };
    let asked = Asked {
        worker: worker.into(),
        n_runs: n_runs.parse()?,
        n_hosts: n_hosts
            .iter()
            .map(|n| n.parse())
            .collect::<Result<_, _>>()?,
        n_cores: std::thread::available_parallelism()?.get(),
    };
    let rows = match kind.as_str() {
        "replicas" => replicas::rows(&asked)?,
        "sets" => sets::rows(&asked)?,
        other => return Err(format!("{other} is neither replicas nor sets").into()),
    };
    let rows = rows.iter().map(|row| {
        json!({
            "megabytes_per_sec": row.megabytes,
            "delay_ms": 0.0,
            "workers": row.n_hosts,
            "seconds": row.seconds,
            "predicted": row.predicted,
        })
    });
    println!(
        "{}",
        serde_json::to_string_pretty(&rows.collect::<Vec<_>>())?
    );
    Ok(())
}

impl Row {
    /// Tells what there is already: all of it takes minutes.
    pub(crate) fn told(self) -> Self {
        eprintln!(
            "{} MB/s, {} hosts: {:.3} s, predicted {:.3} s, {:+.1} %",
            self.megabytes,
            self.n_hosts,
            self.seconds,
            self.predicted,
            100.0 * (self.predicted / self.seconds - 1.0)
        );
        self
    }
}

/// What simulators are told of a link.
pub(crate) fn bytes_per_sec(megabytes: f64) -> f64 {
    if megabytes > 0.0 {
        1e6 * megabytes
    } else {
        f64::INFINITY
    }
}
