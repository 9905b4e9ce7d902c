//! A shade with three questions: through the engine, and as one would write it without.

use std::hint::black_box;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use kilauea_spot::{Answerer, Bytes, Context, Engine, Job, Pool, Program, Queue, Runtime, Server};

use crate::support::hall::{Answer, Geometry, Question, busy_work};

/// How often each way is timed.
const N_TURNS: usize = 200;

/// Shades that a pixel spawns.
const SHADES_A_PIXEL: usize = 16;

/// Pixels, and shades of one kind.
struct Shades {
    /// Sets how much is computed between questions.
    n_terms: u32,
}

impl Program for Shades {
    type Work = Work;
    type Output = f32;
    type Question = Question;
    type Answer = Answer;

    fn starter<'a, R: Runtime<'a, Self>>(
        &'a self,
        runtime: &R,
    ) -> impl Fn(Work, R::Context) -> R::Started {
        let (pixels, shades) = (runtime.pool("pixel"), runtime.pool("shade"));
        move |work, cx| match work {
            Work::Pixel(key) => pixels.start(pixel(key, cx)),
            Work::Shade(key) => shades.start(self.shade(key, cx)),
        }
    }
}

enum Work {
    Pixel(u64),
    Shade(u64),
}

async fn pixel<C: Context<Shades>>(key: u64, cx: C) -> f32 {
    let shades: [_; SHADES_A_PIXEL] =
        std::array::from_fn(|i| cx.spawn(Work::Shade(shade_key(key, i))));
    let mut sum = 0.0;
    for shade in shades {
        sum += shade.await;
    }
    sum
}

fn shade_key(pixel: u64, i: usize) -> u64 {
    pixel * SHADES_A_PIXEL as u64 + i as u64
}

impl Shades {
    async fn shade<C: Context<Self>>(&self, key: u64, cx: C) -> f32 {
        let light = cx.ask(Question::new(key));
        let shadow = cx.ask(Question::new(key ^ 1));
        let bounce = cx.ask(Question::new(key ^ 2));
        let bsdf = busy_work(key, self.n_terms);
        bsdf * light.await.t * shadow.await.t
            + busy_work(key ^ 3, self.n_terms) * bounce.await.weights[0]
    }

    /// A pixel, by hand.
    fn pixel_by_hand(&self, key: u64) -> f32 {
        (0..SHADES_A_PIXEL)
            .map(|i| self.shade_by_hand(shade_key(key, i)))
            .sum()
    }

    /// A shade, by hand.
    fn shade_by_hand(&self, key: u64) -> f32 {
        let light = answer(Question::new(key));
        let shadow = answer(Question::new(key ^ 1));
        let bounce = answer(Question::new(key ^ 2));
        let bsdf = busy_work(key, self.n_terms);
        bsdf * light.t * shadow.t + busy_work(key ^ 3, self.n_terms) * bounce.weights[0]
    }
}

fn answer(question: Question) -> Answer {
    Answerer::<Shades>::answer(&Geometry, question)
}

/// So many pixels, whose outputs are forgotten.
struct Range(u64);

impl Job<Shades> for Range {
    fn root(&self, number: u64) -> Option<Work> {
        (number < self.0).then_some(Work::Pixel(number))
    }

    fn done(&self, _: u64, output: f32) {
        black_box(output);
    }
}

/// The least time of a shade over many turns, in nanoseconds. What else the machine does hits all
/// ways alike, as they take turns.
pub(crate) fn report() {
    println!("shade with three questions, one engine thread, ns, least of {N_TURNS} turns");
    println!(
        "{:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>14}",
        "terms", "by hand", "inline", "overhead", "queued", "bytes", "ns a question"
    );
    for n_terms in [0, 10, 60] {
        let shades = Shades { n_terms };
        // Turns of about a millisecond fit between what else the machine does.
        let n = 4000 / u64::from(n_terms + 3);
        let mut least = [f64::INFINITY; 4];
        for _ in 0..N_TURNS {
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
    // As a loop that shares its pixels with other threads.
    let next_pixel = AtomicU64::new(0);
    loop {
        let key = next_pixel.fetch_add(1, Ordering::SeqCst);
        if key >= n {
            break;
        }
        black_box(shades.pixel_by_hand(black_box(key)));
    }
    nanos_per_shade(start.elapsed(), n)
}

fn time_inline(shades: &Shades, n: u64) -> f64 {
    let stats = expect(Engine::new(1).run_inline(shades, &Geometry, &Range(n)));
    nanos_per_shade(stats.threads[0].total, n)
}

fn time_queued(shades: &Shades, server: &impl Server<Shades>, n: u64) -> f64 {
    let engine = Engine::new(1).budget_bytes(4 << 20);
    let stats = expect(engine.run_queued(shades, server, 1, &Range(n)));
    nanos_per_shade(stats.threads[0].total, n)
}

fn nanos_per_shade(total: Duration, n_pixels: u64) -> f64 {
    total.as_secs_f64() * 1e9 / (n_pixels as usize * SHADES_A_PIXEL) as f64
}

/// Memory of a shade that waits for three answers.
fn report_bytes() {
    let shades = Shades { n_terms: 0 };
    let engine = Engine::new(1);
    let stats = expect(engine.run_queued(&shades, &Queue::new(&Geometry), 1, &Range(50_000)));
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
