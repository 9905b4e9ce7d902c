//! One render node: reads a ticket from its standard input and works until its console has nothing
//! more to do. Needs neither Python nor USD.

#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    match kilauea_cluster::run_worker() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("kilauea-worker: error: {error}");
            ExitCode::FAILURE
        }
    }
}
