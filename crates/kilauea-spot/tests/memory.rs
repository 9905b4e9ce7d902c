//! SPOTs in flight keep within the budget, and what they took is used again.

mod support;

use std::time::Duration;

use kilauea_spot::{Context, Delayed, Engine, Order, Pool, Program, Queue, Runtime, Server, Stats};
use support::hall::{Answer, Geometry, Hall, Node, Question};
use support::outputs::Outputs;

/// Each root leads to some 38 kB if nothing of it ends.
const HALL: Hall = Hall {
    depth: 64,
    fan_out: 3,
    n_terms: 0,
};
const BUDGET: usize = 2 << 20;

fn run(order: Order, server: &impl Server<Hall>) -> Stats {
    let job = Outputs::new(1000, Node::Entrance);
    let engine = Engine::new(2).budget_bytes(BUDGET).order(order);
    let result = engine.run_queued(&HALL, server, 1, &job);
    result.expect("nothing fails")
}

#[test]
fn a_hall_of_mirrors_keeps_within_its_budget() {
    let at_once = run(Order::HighestGeneration, &Queue::new(&Geometry));
    let server = Delayed::new(&Geometry, Duration::from_micros(500));
    let late = run(Order::HighestGeneration, &server);
    for stats in [at_once, late] {
        assert!(stats.peak_bytes() <= BUDGET, "{} bytes", stats.peak_bytes());
    }
}

#[test]
fn without_the_priority_rule_it_does_not() {
    let stats = run(Order::FirstCome, &Queue::new(&Geometry));
    assert!(
        stats.peak_bytes() > 10 * BUDGET,
        "{} bytes",
        stats.peak_bytes()
    );
}

#[test]
fn cells_are_allocated_for_the_peak_and_not_for_every_spot() {
    let stats = run(Order::HighestGeneration, &Queue::new(&Geometry));
    for thread in &stats.threads {
        // Pools of three types may have their peaks at different times.
        assert!(thread.n_cells <= 3 * thread.peak_spots);
    }
    let n_cells: usize = stats.threads.iter().map(|t| t.n_cells).sum();
    assert!((n_cells as u64) < stats.sum(|t| t.n_spots) / 2);
}

/// A root that ends without reading its child.
struct Careless;

impl Program for Careless {
    type Work = bool;
    type Output = u32;
    type Question = Question;
    type Answer = Answer;

    fn starter<'a, R: Runtime<'a, Self>>(
        &'a self,
        runtime: &R,
    ) -> impl Fn(bool, R::Context) -> R::Started {
        let (parents, children) = (runtime.pool("parent"), runtime.pool("child"));
        move |is_root, cx| {
            if is_root {
                parents.start(parent(cx))
            } else {
                children.start(child(cx))
            }
        }
    }
}

async fn parent<C: Context<Careless>>(cx: C) -> u32 {
    drop(cx.spawn(false));
    drop(cx.ask(Question::new(1)));
    cx.ask(Question::new(3)).await.id
}

async fn child<C: Context<Careless>>(cx: C) -> u32 {
    cx.ask(Question::new(2)).await.id
}

#[test]
fn children_that_nobody_awaits_end_before_their_parent_is_done() {
    let job = Outputs::new(1000, |_| true);
    let server = Queue::new(&Geometry);
    let engine = Engine::new(2).budget_bytes(10_000);
    let stats = engine.run_queued(&Careless, &server, 1, &job).unwrap();
    assert_eq!(job.into_vec().len(), 1000);
    assert_eq!(stats.sum(|t| t.n_spots), 2000);
}
