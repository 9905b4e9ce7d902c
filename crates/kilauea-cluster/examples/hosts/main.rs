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

/// What is asked for.
pub(crate) struct Asked {
    pub(crate) worker: PathBuf,
    pub(crate) n_runs: usize,
    pub(crate) n_hosts: Vec<usize>,
    pub(crate) n_cores: usize,
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
    measured::print(&rows)
}
