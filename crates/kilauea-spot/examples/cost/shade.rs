//! A shade with three questions: through the engine, and as one would write it without.

use std::hint::black_box;
use std::time::Instant;

use kilauea_spot::{
    Answerer, Bytes, Context, Engine, Job, Pool, Program, Queue, Runtime, Server, Stats,
};

use crate::support::hall::{Answer, Geometry, Question, mix, unit};

/// Shades of one kind, without children.
struct Shades {
    /// Sets how much is computed between questions.
    n_terms: u32,
}

impl Program for Shades {
    type Work = u64;
    type Output = f32;
    type Question = Question;
    type Answer = Answer;

    fn starter<'a, R: Runtime<'a, Self>>(
        &'a self,
        runtime: &R,
    ) -> impl Fn(u64, R::Context) -> R::Started {
        let shades = runtime.pool();
        move |key, cx| shades.start("shade", self.shade(key, cx))
    }
}

impl Shades {
    async fn shade<C: Context<Self>>(&self, key: u64, cx: C) -> f32 {
        let light = cx.ask(Question::new(key));
        let shadow = cx.ask(Question::new(key ^ 1));
        let bounce = cx.ask(Question::new(key ^ 2));
        let bsdf = self.lobes(key);
        bsdf * light.await.t * shadow.await.t + self.lobes(key ^ 3) * bounce.await.weights[0]
    }

    /// The same, by hand.
    fn shade_by_hand(&self, key: u64) -> f32 {
        let light = answer(Question::new(key));
        let shadow = answer(Question::new(key ^ 1));
        let bounce = answer(Question::new(key ^ 2));
        let bsdf = self.lobes(key);
        bsdf * light.t * shadow.t + self.lobes(key ^ 3) * bounce.weights[0]
    }

    /// Stands for a BSDF.
    #[inline(never)]
    fn lobes(&self, key: u64) -> f32 {
        let mut x = unit(mix(key));
        for _ in 0..self.n_terms {
            x = (1.0 - x * x).abs().sqrt();
        }
        x
    }
}

fn answer(question: Question) -> Answer {
    Answerer::<Shades>::answer(&Geometry, question)
}

/// So many roots, whose outputs are summed per thread and forgotten.
struct Range(u64);

impl Job<Shades> for Range {
    fn root(&self, number: u64) -> Option<u64> {
        (number < self.0).then_some(number)
    }

    fn done(&self, _: u64, output: f32) {
        black_box(output);
    }
}

/// The least time of a shade over many turns, in nanoseconds. What else the machine does hits all
/// ways alike, as they take turns.
pub(crate) fn report() {
    println!("shade with three questions, one engine thread, least of 15 turns");
    println!(
        "{:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>14}",
        "terms", "by hand", "inline", "overhead", "queued", "bytes", "ns a question"
    );
    for n_terms in [0, 10, 60] {
        let shades = Shades { n_terms };
        let n = 1_000_000 / u64::from(n_terms + 2);
        let mut least = [f64::INFINITY; 4];
        for _ in 0..15 {
            let times = [
                time_by_hand(&shades, n),
                time_inline(&shades, n),
                time_queued(&shades, &Queue::new(&Geometry), n),
                time_queued(&shades, &Bytes::new(&Geometry), n),
            ];
            for (least, time) in least.iter_mut().zip(times) {
                *least = least.min(time);
            }
        }
        let [by_hand, inline, queued, bytes] = least;
        println!(
            "{n_terms:>9} {by_hand:>9.1} {inline:>9.1} {:>8.1}% {queued:>9.1} {bytes:>9.1} {:>14.1}",
            100.0 * (inline / by_hand - 1.0),
            (queued - by_hand) / 3.0,
        );
    }
    report_bytes();
}

fn time_by_hand(shades: &Shades, n: u64) -> f64 {
    let start = Instant::now();
    for key in 0..n {
        black_box(shades.shade_by_hand(black_box(key)));
    }
    start.elapsed().as_secs_f64() * 1e9 / n as f64
}

fn time_inline(shades: &Shades, n: u64) -> f64 {
    let stats = Engine::new(1).run_inline(shades, &Geometry, &Range(n));
    nanos_per_root(&expect(stats), n)
}

fn time_queued(shades: &Shades, server: &impl Server<Shades>, n: u64) -> f64 {
    let engine = Engine::new(1).budget_bytes(4 << 20);
    nanos_per_root(&expect(engine.run_queued(shades, server, 1, &Range(n))), n)
}

fn nanos_per_root(stats: &Stats, n: u64) -> f64 {
    stats.threads[0].total.as_secs_f64() * 1e9 / n as f64
}

/// Memory of a shade that waits for three answers.
fn report_bytes() {
    let shades = Shades { n_terms: 0 };
    let engine = Engine::new(1);
    let stats = expect(engine.run_queued(&shades, &Queue::new(&Geometry), 1, &Range(1_000_000)));
    let thread = &stats.threads[0];
    let bytes = thread.peak_bytes as f64 / thread.peak_spots as f64;
    println!(
        "bytes in flight: {bytes:.0} a waiting shade, {:.0} a question, all included; \
         {} cells for {} shades",
        bytes / 3.0,
        thread.n_cells,
        thread.n_spots
    );
}

pub(crate) fn expect<T, E: std::fmt::Display>(result: Result<T, E>) -> T {
    result.unwrap_or_else(|error| panic!("the run failed: {error}"))
}
