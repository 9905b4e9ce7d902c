//! Memory and idleness where every root leads to a chain of SPOTs.

use std::time::Duration;

use kilauea_spot::{Delayed, Engine, Order, Queue, Server, Stats, ThreadStats};

use crate::shade::expect;
use crate::support::hall::{Geometry, Hall, Node};
use crate::support::outputs::Outputs;

/// About what a root leads to if nothing of it has ended.
const TREE_BYTES: usize = 38_000;
const MIB: f64 = (1 << 20) as f64;

/// Peaks with and without the priority rule.
pub(crate) fn report_memory() {
    let hall = Hall {
        depth: 64,
        fan_out: 3,
        n_terms: 0,
    };
    println!("hall of mirrors, 64 deep, three children a node, two engine threads");
    println!(
        "{:>8} {:>10} {:>22} {:>10} {:>10} {:>8} {:>8}",
        "budget", "answers", "order", "peak MiB", "of budget", "SPOTs", "seconds"
    );
    let now = Queue::new(&Geometry);
    let later = Delayed::new(&Geometry, Duration::from_millis(10));
    for budget_mib in [16, 64, 256] {
        let budget = budget_mib << 20;
        // All roots together would take twelve times the budget.
        let n_roots = 12 * budget / TREE_BYTES;
        for order in [Order::HighestGeneration, Order::FirstCome] {
            let stats = run(hall, budget, order, &now, n_roots);
            print_memory(budget_mib, "at once", order, &stats);
        }
        let order = Order::HighestGeneration;
        let stats = run(hall, budget, order, &later, n_roots);
        print_memory(budget_mib, "<= 10 ms", order, &stats);
    }
}

fn print_memory(budget_mib: usize, answers: &str, order: Order, stats: &Stats) {
    let peak_mib = stats.peak_bytes() as f64 / MIB;
    println!(
        "{budget_mib:>8} {answers:>10} {:>22} {peak_mib:>10.1} {:>9.2}x {:>8} {:>8.2}",
        format!("{order:?}"),
        peak_mib / budget_mib as f64,
        stats.peak_spots(),
        stats.wall.as_secs_f64(),
    );
}

/// How busy threads stay although every answer takes its time.
pub(crate) fn report_delays() {
    let hall = Hall {
        depth: 2,
        fan_out: 2,
        n_terms: 60,
    };
    let n_roots = 500_000;
    let job = Outputs::new(n_roots, Node::Entrance);
    expect(Engine::new(2).run_inline(&hall, &Geometry, &job));
    let expected = job.into_vec();

    println!("answers after up to 10 ms in random order, two engine threads");
    println!(
        "{:>8} {:>11} {:>11} {:>10} {:>10} {:>8} {:>10}",
        "budget", "least busy", "with memory", "SPOTs", "peak SPOTs", "seconds", "same bits"
    );
    for budget_mib in [16, 64, 256] {
        let job = Outputs::new(n_roots, Node::Entrance);
        let server = Delayed::new(&Geometry, Duration::from_millis(10));
        let engine = Engine::new(2).budget_bytes(budget_mib << 20);
        let stats = expect(engine.run_queued(&hall, &server, 1, &job));
        println!(
            "{budget_mib:>8} {:>10.1}% {:>10.1}% {:>10} {:>10} {:>8.2} {:>10}",
            100.0 * least(&stats, ThreadStats::busy_fraction),
            100.0 * least(&stats, ThreadStats::busy_fraction_with_memory),
            stats.sum(|t| t.n_spots),
            stats.peak_spots(),
            stats.wall.as_secs_f64(),
            job.into_vec() == expected,
        );
    }
}

fn run(hall: Hall, budget: usize, order: Order, server: &impl Server<Hall>, n: usize) -> Stats {
    let job = Outputs::new(n, Node::Entrance);
    let engine = Engine::new(2).budget_bytes(budget).order(order);
    expect(engine.run_queued(&hall, server, 1, &job))
}

fn least(stats: &Stats, fraction: fn(&ThreadStats) -> f64) -> f64 {
    stats.threads.iter().map(fraction).fold(1.0, f64::min)
}
