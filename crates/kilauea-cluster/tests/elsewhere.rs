//! Workers that somebody else starts, over TLS.

mod frame;

use std::net::TcpStream;
use std::thread;
use std::time::Duration;

use frame::elsewhere::{HERE, serve, start_thread};
use frame::{Shot, processes};
use kilauea_cluster::{ClusterOptions, Ticket, run_worker_for};

#[test]
fn tls_changes_no_bit() {
    let shot = Shot::new();
    let options = ClusterOptions {
        tls: true,
        ..frame::options(2, processes())
    };
    let result = shot.start(options).finish().unwrap();
    shot.check(&shot.alone(), &result, "two processes over TLS");
}

#[test]
fn workers_join_with_the_tickets_that_are_brought_to_them() {
    let shot = Shot::new();
    let options = frame::options(3, HERE);
    assert!(options.tls, "between machines");
    let job = shot.start(options);
    let mut workers = Vec::new();
    serve(&job, |_, ticket| workers.push(start_thread(ticket)));
    let result = job.finish().unwrap();
    shot.check(&shot.alone(), &result, "three workers elsewhere");
    assert_eq!(workers.len(), 3);
    for worker in workers {
        worker.join().unwrap().unwrap();
    }
}

#[test]
fn one_that_is_known_to_have_ended_is_started_again() {
    let shot = Shot::new();
    let job = shot.start(frame::options(1, HERE));
    let mut tickets = Vec::new();
    serve(&job, |job, ticket| {
        tickets.push((ticket.epoch, ticket.rank, ticket.incarnation));
        match ticket.incarnation {
            0 => job.worker_ended(ticket.epoch, "its machine is gone".into()),
            _ => drop(start_thread(ticket)),
        }
    });
    assert_eq!(tickets, [(1, 0, 0), (2, 0, 1)]);
    let result = job.finish().unwrap();
    shot.check(&shot.alone(), &result, "after a lost machine");
    assert_eq!(
        result.workers[0].lost.as_deref(),
        Some("its machine is gone")
    );
}

#[test]
fn nobody_joins_without_a_certificate_of_the_session() {
    let shot = Shot::new();
    let job = shot.start(frame::options(1, HERE));
    let strangers = shot.start(frame::options(1, HERE));
    let stranger = loop {
        if let Some(ticket) = strangers.take_tickets().pop() {
            break ticket;
        }
        thread::sleep(Duration::from_millis(5));
    };
    serve(&job, |_, ticket| {
        // Without TLS, with a certificate of another session, and with nothing to say.
        let plain = Ticket {
            identity: None,
            ..ticket.clone()
        };
        assert!(run_worker_for(&plain).is_err());
        let other = Ticket {
            identity: stranger.identity.clone(),
            ..ticket.clone()
        };
        assert!(run_worker_for(&other).is_err());
        let silent = TcpStream::connect(&ticket.address).unwrap();
        start_thread(ticket);
        drop(silent);
    });
    let result = job.finish().unwrap();
    shot.check(&shot.alone(), &result, "whoever else knocked");
    strangers.cancel();
}
