//! What a Prometheus server gets while frames are rendered.

mod frame;

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};

use frame::Shot;
use frame::elsewhere::{next_ticket, open_options, start_through, wait_until};
use kilauea_cluster::{MetricsServer, WorkerKind};

/// What comes back for the head of a request: status line and headers, and the body.
fn ask(address: SocketAddr, head: &str) -> (String, String) {
    let mut stream = TcpStream::connect(address).expect("it listens");
    stream.write_all(head.as_bytes()).expect("it reads");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("it answers");
    let (head, body) = answer.split_once("\r\n\r\n").expect("a head and a body");
    (head.to_owned(), body.to_owned())
}

/// Values by name and labels.
fn scrape(server: &MetricsServer) -> BTreeMap<String, f64> {
    let (head, body) = ask(
        server.address(),
        "GET /metrics HTTP/1.1\r\nHost: here\r\n\r\n",
    );
    assert!(head.starts_with("HTTP/1.1 200 OK\r\n"), "{head}");
    assert!(
        head.contains("Content-Type: text/plain; version=0.0.4"),
        "{head}"
    );
    let samples = body.lines().filter(|line| !line.starts_with('#'));
    samples
        .map(|line| {
            let (name, value) = line.rsplit_once(' ').expect("a name and a value");
            (name.to_owned(), value.parse().expect("a number"))
        })
        .collect()
}

#[test]
fn figures_of_a_frame_and_sums_over_frames() {
    let server = MetricsServer::bind("127.0.0.1:0").unwrap();
    let before = scrape(&server);
    assert_eq!(before["kilauea_frames_begun_total"], 0.0);
    let shot = Shot::new();
    let first = shot.start(frame::options(2, WorkerKind::Threads));
    server.watch(&first);
    let first = first.finish().unwrap();
    let after = scrape(&server);
    let units: u64 = first.workers.iter().map(|worker| worker.units).sum();
    let rays: u64 = first.workers.iter().map(|worker| worker.rays).sum();
    assert_eq!(after["kilauea_units_done_total"], units as f64);
    assert_eq!(after["kilauea_frame_units"], units as f64);
    assert_eq!(after["kilauea_frame_done_ratio"], 1.0);
    assert_eq!(after["kilauea_units_leased"], 0.0);
    let by_worker = |name: &str| {
        let of = |worker| after[&format!("{name}{{worker=\"{worker}\"}}")];
        of(0) + of(1)
    };
    assert_eq!(by_worker("kilauea_worker_units_done_total"), units as f64);
    assert_eq!(by_worker("kilauea_worker_rays_total"), rays as f64);
    let received = first.network.bytes_received as f64;
    assert_eq!(after["kilauea_network_received_bytes_total"], received);

    let second = shot.start(frame::options(1, WorkerKind::Threads));
    server.watch(&second);
    second.finish().unwrap();
    let total = scrape(&server);
    assert_eq!(total["kilauea_frames_begun_total"], 2.0);
    assert!(total["kilauea_units_done_total"] > units as f64);
    assert_eq!(total["kilauea_workers_started_total"], 3.0);
}

#[test]
fn workers_are_seen_by_their_states() {
    let server = MetricsServer::bind("127.0.0.1:0").unwrap();
    let shot = Shot::new();
    let job = shot.start(open_options(1));
    server.watch(&job);
    let ticket = next_ticket(&job, &mut Vec::new());
    wait_until(&job, "a start", |s| s.n_started == 1);
    let state = |name| scrape(&server)[&format!("kilauea_workers{{state=\"{name}\"}}")];
    assert_eq!((state("starting"), state("working")), (1.0, 0.0));
    job.worker_ended(ticket.epoch, "its machine is gone".into());
    wait_until(&job, "its end", |s| s.n_started == 2);
    let now = scrape(&server);
    assert_eq!(now["kilauea_workers_lost_total"], 1.0);
    assert_eq!(now["kilauea_worker_epoch{worker=\"0\"}"], 2.0);
    let ticket = next_ticket(&job, &mut Vec::new());
    start_through(ticket.address.clone(), ticket);
    job.finish().unwrap();
    assert_eq!((state("starting"), state("finished")), (0.0, 1.0));
}

#[test]
fn strangers_get_an_answer_or_none_and_do_no_harm() {
    let server = MetricsServer::bind("127.0.0.1:0").unwrap();
    let status = |head: &str| ask(server.address(), head).0;
    assert!(status("GET / HTTP/1.1\r\n\r\n").contains("404"));
    assert!(status("DELETE /metrics HTTP/1.1\r\n\r\n").contains("405"));
    assert!(status("nonsense\r\n\r\n").contains("400"));
    let long = format!("GET /metrics HTTP/1.1\r\nA: {}", "a".repeat(10_000));
    let mut stream = TcpStream::connect(server.address()).unwrap();
    // It is answered, or cut off, before all of it is read.
    let _ = stream.write_all(long.as_bytes());
    // Some who say nothing, beside one who does.
    let silent: Vec<TcpStream> = (0..4)
        .map(|_| TcpStream::connect(server.address()).unwrap())
        .collect();
    assert!(!scrape(&server).is_empty());
    drop(silent);
    let address = server.address();
    assert!(
        MetricsServer::bind(&address.to_string()).is_err(),
        "it is taken"
    );
    drop(server);
    assert!(
        TcpStream::connect(address).is_err(),
        "nobody listens any more"
    );
}
