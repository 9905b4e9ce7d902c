//! Memory and idleness where every root leads to a chain of SPOTs.

use std::time::Duration;

use kilauea_spot::{Engine, Order, Queue, Server, Stats};

use crate::shade::expect;
use crate::support::delayed::Delayed;
use crate::support::hall::{Geometry, Hall, Node};
use crate::support::outputs::Outputs;

const MIB: f64 = (1 << 20) as f64;

/// Peaks with and without the priority rule.
pub(crate) fn report_memory() {
    let hall = Hall {
        depth: 64,
        fan_out: 3,
    };
    println!("hall of mirrors, 64 deep, three children a node, two engine threads");
    println!(
        "{:>8} {:>10} {:>22} {:>10} {:>10} {:>8} {:>7}",
        "budget", "answers", "order", "peak MiB", "of budget", "SPOTs", "busy"
    );
    let now = Queue::new(&Geometry);
    let later = Delayed {
        answerer: &Geometry,
        max_delay: Duration::from_millis(10),
    };
    for budget_mib in [16, 64, 256] {
        let budget = budget_mib << 20;
        for order in [Order::HighestGeneration, Order::FirstCome] {
            // Enough roots for either rule to reach its peak.
            let n_roots = budget / 400;
            let stats = run(hall, budget, order, &now, n_roots);
            print_memory(budget_mib, "at once", order, &stats);
        }
        let stats = run(hall, budget, Order::HighestGeneration, &later, budget / 8000);
        print_memory(budget_mib, "<= 10 ms", Order::HighestGeneration, &stats);
    }
}

fn print_memory(budget_mib: usize, answers: &str, order: Order, stats: &Stats) {
    let peak_mib = stats.peak_bytes() as f64 / MIB;
    println!(
        "{budget_mib:>8} {answers:>10} {:>22} {peak_mib:>10.1} {:>9.2}x {:>8} {:>6.1}%",
        format!("{order:?}"),
        peak_mib / budget_mib as f64,
        stats.peak_spots(),
        100.0 * least_busy(stats),
    );
}

/// How busy threads stay although every answer takes its time.
pub(crate) fn report_delays() {
    let hall = Hall {
        depth: 8,
        fan_out: 3,
    };
    println!("answers after up to 10 ms in random order, two engine threads, 512 MiB");
    let job = Outputs::new(200_000, Node::Entrance);
    expect(Engine::new(2).run_inline(&hall, &Geometry, &job));
    let expected = job.into_vec();

    let job = Outputs::new(200_000, Node::Entrance);
    let server = Delayed {
        answerer: &Geometry,
        max_delay: Duration::from_millis(10),
    };
    let engine = Engine::new(2).budget_bytes(512 << 20).questions_out(1 << 20);
    let stats = expect(engine.run_queued(&hall, &server, 1, &job));
    let is_same = job.into_vec() == expected;
    println!(
        "least busy thread {:.1}%, {} SPOTs in {:.2} s, peak {} SPOTs, same bits: {is_same}",
        100.0 * least_busy(&stats),
        stats.sum(|t| t.n_spots),
        stats.wall.as_secs_f64(),
        stats.peak_spots()
    );
}

fn run(hall: Hall, budget: usize, order: Order, server: &impl Server<Hall>, n: usize) -> Stats {
    let job = Outputs::new(n, Node::Entrance);
    let engine = Engine::new(2).budget_bytes(budget).order(order);
    expect(engine.run_queued(&hall, server, 1, &job))
}

fn least_busy(stats: &Stats) -> f64 {
    let busy = stats.threads.iter().map(|t| t.busy_fraction());
    busy.fold(1.0, f64::min)
}
