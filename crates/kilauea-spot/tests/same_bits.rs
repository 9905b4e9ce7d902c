//! However questions are answered and in whatever order, the outputs are the same bits.

mod support;

use std::time::Duration;

use kilauea_spot::{Bytes, Delayed, Engine, Order, Queue, Server};
use support::hall::{Geometry, Hall, Node};
use support::outputs::Outputs;

const HALL: Hall = Hall {
    depth: 12,
    fan_out: 3,
    n_terms: 0,
};
const N_ROOTS: usize = 300;

fn inline(n_threads: usize) -> Vec<[u32; 3]> {
    let job = Outputs::new(N_ROOTS, Node::Entrance);
    let engine = Engine::new(n_threads);
    let result = engine.run_inline(&HALL, &Geometry, &job);
    result.expect("nothing fails");
    bits(job.into_vec())
}

fn queued(engine: &Engine, server: &impl Server<Hall>, n_servers: usize) -> Vec<[u32; 3]> {
    let job = Outputs::new(N_ROOTS, Node::Entrance);
    let result = engine.run_queued(&HALL, server, n_servers, &job);
    let stats = result.expect("nothing fails");
    // An entrance, mirrors 12 to 0 with two walls each, and the last wall.
    let n_spots = N_ROOTS as u64 * (1 + 13 * 3 + 1);
    assert_eq!(stats.sum(|t| t.n_spots), n_spots);
    assert_eq!(stats.sum(|t| t.n_roots), N_ROOTS as u64);
    bits(job.into_vec())
}

fn bits(outputs: Vec<[f32; 3]>) -> Vec<[u32; 3]> {
    outputs.into_iter().map(|o| o.map(f32::to_bits)).collect()
}

#[test]
fn threads_do_not_matter() {
    let expected = inline(1);
    let distinct: std::collections::BTreeSet<_> = expected.iter().collect();
    assert_eq!(distinct.len(), N_ROOTS, "outputs tell roots apart");
    for n_threads in [1, 2, 7] {
        assert_eq!(inline(n_threads), expected);
        let engine = Engine::new(n_threads);
        assert_eq!(queued(&engine, &Queue::new(&Geometry), 2), expected);
        assert_eq!(queued(&engine, &Bytes::new(&Geometry), 2), expected);
    }
}

#[test]
fn delays_and_order_of_arrival_do_not_matter() {
    let expected = inline(1);
    for n_threads in [1, 3] {
        let server = Delayed::new(&Geometry, Duration::from_millis(2));
        assert_eq!(queued(&Engine::new(n_threads), &server, 2), expected);
    }
}

#[test]
fn limits_do_not_matter() {
    let expected = inline(1);
    let engines = [
        Engine::new(2).batch_len(1),
        Engine::new(2).questions_out(1),
        Engine::new(3).budget_bytes(20_000),
        // So little that not even one root is within it.
        Engine::new(3).budget_bytes(1),
        Engine::new(2).order(Order::FirstCome),
    ];
    for engine in engines {
        assert_eq!(queued(&engine, &Queue::new(&Geometry), 1), expected);
    }
}
