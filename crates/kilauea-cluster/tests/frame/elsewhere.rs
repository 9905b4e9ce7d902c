//! Workers that the tests start, in threads, over connections that they choose.

use std::net::{IpAddr, Ipv4Addr};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use kilauea_cluster::{
    ClusterJob, ClusterOptions, Snapshot, Ticket, WorkerError, WorkerKind, run_worker_for,
};

pub(crate) const HERE: WorkerKind = WorkerKind::Elsewhere {
    host: IpAddr::V4(Ipv4Addr::LOCALHOST),
};

/// Nothing that is waited for takes longer, however busy the machine is.
const LONG: Duration = Duration::from_mins(2);

/// Workers whose bytes a proxy may touch, that may be started again as often as it takes.
pub(crate) fn open_options(n_workers: u32) -> ClusterOptions {
    ClusterOptions {
        tls: false,
        max_restarts: 1000,
        ..super::options(n_workers, HERE)
    }
}

pub(crate) fn start_thread(ticket: Ticket) -> JoinHandle<Result<(), WorkerError>> {
    thread::spawn(move || run_worker_for(&ticket))
}

/// Starts a worker that reaches its console at another address.
pub(crate) fn start_through(
    address: String,
    ticket: Ticket,
) -> JoinHandle<Result<(), WorkerError>> {
    start_thread(Ticket { address, ..ticket })
}

/// Starts what a job wants to be started, as `start` does, until it has ended.
pub(crate) fn serve(job: &ClusterJob, mut start: impl FnMut(&ClusterJob, Ticket)) {
    while !job.wait(Duration::from_millis(20)) {
        for ticket in job.take_tickets() {
            start(job, ticket);
        }
    }
}

/// Waits for the next ticket that a job gives out.
pub(crate) fn next_ticket(job: &ClusterJob, tickets: &mut Vec<Ticket>) -> Ticket {
    let begun = Instant::now();
    while tickets.is_empty() {
        assert!(begun.elapsed() < LONG && !job.wait(Duration::from_millis(5)));
        tickets.extend(job.take_tickets());
    }
    tickets.remove(0)
}

/// Waits until the console knows something.
pub(crate) fn wait_until(
    job: &ClusterJob,
    what: &str,
    mut is_known: impl FnMut(&Snapshot) -> bool,
) {
    let begun = Instant::now();
    while !is_known(&job.snapshot()) {
        assert!(begun.elapsed() < LONG, "{what}: {:?}", job.snapshot());
        assert!(!job.wait(Duration::from_millis(5)), "ended before {what}");
    }
}
