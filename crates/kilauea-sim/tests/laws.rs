//! Simulated sets against closed forms, and nothing gets lost on the way.

use kilauea_sim::{Batching, Machine, RaySizes, RayTrace, SetModel, law};

const SIZES: RaySizes = RaySizes {
    ray: 32.0,
    hit: 20.0,
    frame: 0.0,
};

/// Enough rays under way to hide the way.
const BATCHING: Batching = Batching {
    rays: 64,
    seal_secs: 0.5e-3,
    rtt_secs: 0.2e-3,
    pool: 4 << 10,
};

fn model(trace: &RayTrace, machine: Machine, n: usize, is_full_broadcast: bool) -> SetModel<'_> {
    SetModel {
        machines: vec![machine; n],
        sizes: SIZES,
        batching: BATCHING,
        trace,
        is_full_broadcast,
        saved_by_own: 0.0,
    }
}

/// Rays a second of each machine, simulated and by the law.
fn check(trace: &RayTrace, machine: Machine, n: usize, is_full: bool) {
    let outcome = model(trace, machine, n, is_full).run(0.1, 0.3);
    let asking = trace.asking(n, is_full);
    let expected = law::rays_per_machine(&machine, &asking, &SIZES);
    let found = outcome.rays_per_sec() / n as f64;
    assert!(
        (found / expected - 1.0).abs() < 0.05,
        "{n} machines, full: {is_full}: {found}, by the law {expected}; {outcome:?}"
    );
}

#[test]
fn sets_that_their_processors_bound() {
    let trace = RayTrace::by_chance(4000, 640, 4, 0.4);
    let machine = Machine {
        shade_secs: 0.1e-6,
        ..Machine::new(2.0, 100.0)
    };
    for n in [1, 2, 8] {
        check(&trace, machine, n, false);
        check(&trace, machine, n, true);
    }
}

#[test]
fn sets_that_their_network_bounds() {
    let trace = RayTrace::by_chance(4000, 640, 4, 0.4);
    for n in [2, 8] {
        check(&trace, Machine::new(20.0, 1.0), n, false);
        check(&trace, Machine::new(20.0, 1.0), n, true);
    }
}

#[test]
fn rays_and_bytes_are_conserved() {
    let trace = RayTrace::by_chance(1000, 64, 3, 0.5);
    let model = model(&trace, Machine::new(1.0, 10.0), 5, false);
    let outcome = model.run(0.0, 0.1);
    let [asked, answered] = outcome.asked_and_answered;
    assert_eq!(asked, answered + outcome.under_way);
    assert!(answered > 10_000);
    // What is on its way at either end is all that may differ.
    let sent: f64 = outcome.bytes_sent.iter().sum();
    let received: f64 = outcome.bytes_received.iter().sum();
    let on_the_way = 5.0 * BATCHING.pool as f64 * 3.0 * SIZES.ray;
    assert!(sent >= received && sent - received <= on_the_way);
    let traced: u64 = outcome.traced.iter().sum();
    let per_ray = trace.asking(5, false).asked;
    let least = 0.97 * per_ray * answered as f64;
    let most = 1.03 * per_ray * asked as f64;
    assert!((least..most).contains(&(traced as f64)), "{traced}");
}

/// A ray waits for all whom it asks, so a set is as fast as its slowest member.
#[test]
fn a_straggler_holds_its_set_back() {
    let trace = RayTrace::by_chance(4000, 640, 4, 0.4);
    let mut slow = model(&trace, Machine::new(2.0, 100.0), 4, true);
    slow.machines[1].rays_per_sec /= 4.0;
    let undisturbed = model(&trace, Machine::new(2.0, 100.0), 4, true).run(0.2, 0.6);
    let ratio = slow.run(0.2, 0.6).rays_per_sec() / undisturbed.rays_per_sec();
    assert!((ratio / 0.25 - 1.0).abs() < 0.1, "{ratio}");
}

/// With few rays under way the way there and back is all there is: as many rays as the pool holds
/// in each round trip.
#[test]
fn latency_is_hidden_by_rays_under_way() {
    let trace = RayTrace::by_chance(4000, 640, 4, 0.4);
    let with_pool = |pool| {
        let mut model = model(&trace, Machine::new(20.0, 100.0), 4, true);
        model.batching = Batching {
            rtt_secs: 10e-3,
            pool,
            ..BATCHING
        };
        model.run(0.1, 0.2).rays_per_sec() / 4.0
    };
    let few = with_pool(256);
    assert!(
        few < 1.05 * 256.0 / 10e-3 && few > 0.5 * 256.0 / 11e-3,
        "{few}"
    );
    let many = with_pool(16 << 10);
    assert!(many > 20.0 * few, "{many} {few}");
}

/// Of m members, who asks holds 1/m of what could spare a question.
#[test]
fn looking_at_home_first_saves_questions() {
    let trace = RayTrace::by_chance(4000, 640, 4, 0.4);
    for n in [2, 5] {
        let mut model = model(&trace, Machine::new(2.0, 100.0), n, true);
        let traced_per_ray = |model: &SetModel<'_>| {
            let outcome = model.run(0.1, 0.3);
            outcome.traced.iter().sum::<u64>() as f64 / outcome.answered.iter().sum::<u64>() as f64
        };
        let others = n as f64 - 1.0;
        assert!((traced_per_ray(&model) / n as f64 - 1.0).abs() < 0.02);
        model.saved_by_own = 0.8;
        let expected = 1.0 + others * (1.0 - 0.8 / n as f64);
        let found = traced_per_ray(&model);
        assert!((found / expected - 1.0).abs() < 0.02, "{n}: {found}");
    }
}

/// Processors spend the time of questions beside that of tracing: here as much again for all that
/// others are asked.
#[test]
fn questions_cost_both_sides() {
    let trace = RayTrace::by_chance(4000, 640, 4, 0.4);
    let rate = |question_secs| {
        let machine = Machine {
            question_secs,
            ..Machine::new(2.0, 100.0)
        };
        model(&trace, machine, 2, true).run(0.1, 0.3).rays_per_sec()
    };
    // Each ray is traced twice, and is one question.
    let ratio = rate(0.5e-6) / rate(0.0);
    assert!((ratio / (2.0 / 3.0) - 1.0).abs() < 0.03, "{ratio}");
}
