//! How runs end early: each way to fail is an error as a value, soon, and of all threads.

mod support;

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use kilauea_spot::{
    Answerer, Bytes, Context, Delayed, Engine, Job, Pool, Program, Queue, RunError, Runtime, Stats,
    Wire, WireError, decode_batch, encode_batch,
};
use support::hall::mix;

/// What goes wrong in root number 100 of a program.
#[derive(Clone, Copy, PartialEq)]
enum Fault {
    None,
    Panic,
    AwaitNothing,
    AnswererPanics,
    BytesAreCut,
    JobPanics,
}

struct Faulty(Fault);

/// A question that may not survive its way.
#[derive(Clone)]
struct Question {
    number: u64,
    is_cut: bool,
}

impl Program for Faulty {
    type Work = u64;
    type Output = u64;
    type Question = Question;
    type Answer = u64;

    fn starter<'a, R: Runtime<'a, Self>>(
        &'a self,
        runtime: &R,
    ) -> impl Fn(u64, R::Context) -> R::Started {
        let (outer, inner) = (runtime.pool("/World/Outer"), runtime.pool("/World/Inner"));
        move |number, cx| {
            if number < 1000 {
                outer.start(outer_spot(number, cx))
            } else {
                inner.start(self.inner_spot(number - 1000, cx))
            }
        }
    }
}

async fn outer_spot<C: Context<Faulty>>(number: u64, cx: C) -> u64 {
    cx.spawn(1000 + number).await
}

impl Faulty {
    async fn inner_spot<C: Context<Self>>(&self, number: u64, cx: C) -> u64 {
        let is_here = number == 100;
        let is_cut = is_here && self.0 == Fault::BytesAreCut;
        let answer = cx.ask(Question { number, is_cut }).await;
        if is_here && self.0 == Fault::AwaitNothing {
            std::future::pending::<()>().await;
        }
        assert!(!is_here || self.0 != Fault::Panic, "no BSDF for {number}");
        answer
    }
}

impl Answerer<Faulty> for Faulty {
    fn answer(&self, question: Question) -> u64 {
        let is_here = question.number == 100;
        assert!(!is_here || self.0 != Fault::AnswererPanics, "no such ray");
        question.number
    }
}

impl Wire for Question {
    fn encode(&self, bytes: &mut Vec<u8>) {
        self.is_cut.encode(bytes);
        if !self.is_cut {
            self.number.encode(bytes);
        }
    }

    fn decode(bytes: &mut &[u8]) -> Result<Self, WireError> {
        Ok(Self {
            is_cut: bool::decode(bytes)?,
            number: u64::decode(bytes)?,
        })
    }
}

/// Endless roots, or 500.
struct Roots<'a> {
    fault: Fault,
    is_endless: bool,
    is_cancelled: &'a AtomicBool,
}

impl Job<Faulty> for Roots<'_> {
    fn root(&self, number: u64) -> Option<u64> {
        if self.is_endless {
            Some(number % 500)
        } else {
            (number < 500).then_some(number)
        }
    }

    fn done(&self, number: u64, output: u64) {
        assert_eq!(output, number % 500, "root {number}");
        assert!(self.fault != Fault::JobPanics || number != 100, "disk full");
    }

    fn is_cancelled(&self) -> bool {
        self.is_cancelled.load(Ordering::Relaxed)
    }
}

/// Runs a faulty program inline, queued and through bytes.
fn run_all_ways(fault: Fault) -> [Result<Stats, RunError>; 3] {
    let program = Faulty(fault);
    let job = Roots {
        fault,
        is_endless: false,
        is_cancelled: &AtomicBool::new(false),
    };
    // One question a batch, so that a batch that is cut has a length to state.
    let engine = Engine::new(3).batch_len(1);
    [
        engine.run_inline(&program, &program, &job),
        engine.run_queued(&program, &Queue::new(&program), 2, &job),
        engine.run_queued(&program, &Bytes::new(&program), 2, &job),
    ]
}

#[test]
fn without_a_fault_all_ways_end_well() {
    for result in run_all_ways(Fault::None) {
        assert_eq!(result.unwrap().sum(|t| t.n_roots), 500);
    }
}

#[test]
fn a_panic_names_the_innermost_spot() {
    let expected = RunError::Panicked {
        label: "/World/Inner".to_owned(),
        message: "no BSDF for 100".to_owned(),
    };
    for result in run_all_ways(Fault::Panic) {
        assert_eq!(result.unwrap_err(), expected);
    }
}

#[test]
fn a_spot_that_awaits_nothing_of_ours_is_named() {
    let expected = RunError::Stuck {
        label: "/World/Inner".to_owned(),
    };
    for result in run_all_ways(Fault::AwaitNothing) {
        assert_eq!(result.unwrap_err(), expected);
    }
}

#[test]
fn a_panic_of_who_answers_ends_the_run() {
    let [inline, queued, bytes] = run_all_ways(Fault::AnswererPanics).map(Result::unwrap_err);
    let label = "/World/Inner".to_owned();
    let message = "no such ray".to_owned();
    assert_eq!(
        inline,
        RunError::Panicked {
            label,
            message: message.clone()
        }
    );
    for error in [queued, bytes] {
        assert!(
            matches!(&error, RunError::ThreadPanicked { message: m, .. } if *m == message),
            "{error}"
        );
    }
}

#[test]
fn a_panic_of_the_job_ends_the_run() {
    for result in run_all_ways(Fault::JobPanics) {
        let error = result.unwrap_err();
        assert!(
            matches!(&error, RunError::ThreadPanicked { message, .. } if message == "disk full"),
            "{error}"
        );
    }
}

#[test]
fn bytes_that_are_cut_end_the_run() {
    let [inline, queued, bytes] = run_all_ways(Fault::BytesAreCut);
    assert!(inline.is_ok() && queued.is_ok());
    // Thread, count, ticket, and a question that is a byte long.
    let expected = RunError::Malformed {
        n_bytes: 4 + 4 + 8 + 1,
        source: WireError::Short,
    };
    assert_eq!(bytes.unwrap_err(), expected);
}

#[test]
fn no_bytes_make_the_decoder_panic() {
    for seed in 0..20_000 {
        let n = (mix(seed) % 40) as usize;
        let bytes: Vec<u8> = (0..n).map(|i| mix(seed ^ i as u64) as u8).collect();
        if let Ok((thread, batch)) = decode_batch::<u64>(&bytes) {
            assert_eq!(encode_batch(thread, &batch), bytes);
        }
    }
    let one_too_many = [encode_batch::<u64>(3, &[]), vec![0]].concat();
    let error = decode_batch::<u64>(&one_too_many).unwrap_err();
    let source = WireError::Long(1);
    assert_eq!(error, RunError::Malformed { n_bytes: 9, source });
}

/// Cancels 50 ms after `run` has begun, and checks that it ends before answers come that are a
/// minute away.
fn check_cancelled(run: impl FnOnce(&Roots<'_>) -> Result<Stats, RunError>) {
    let is_cancelled = AtomicBool::new(false);
    let job = Roots {
        fault: Fault::None,
        is_endless: true,
        is_cancelled: &is_cancelled,
    };
    std::thread::scope(|threads| {
        let cancel = threads.spawn(|| {
            std::thread::sleep(Duration::from_millis(50));
            is_cancelled.store(true, Ordering::Relaxed);
            Instant::now()
        });
        assert_eq!(run(&job).err(), Some(RunError::Cancelled));
        let end = Instant::now();
        let cancelled_at = cancel.join().expect("it only sleeps");
        assert!(end - cancelled_at < Duration::from_secs(30));
    });
}

#[test]
fn cancelled_runs_wait_for_no_answer() {
    let program = Faulty(Fault::None);
    let engine = Engine::new(3);
    check_cancelled(|job| engine.run_inline(&program, &program, job));
    check_cancelled(|job| engine.run_queued(&program, &Queue::new(&program), 2, job));
    check_cancelled(|job| engine.run_queued(&program, &Bytes::new(&program), 2, job));
    // All SPOTs wait for answers that are a minute away.
    let server = Delayed::new(&program, Duration::from_mins(1));
    check_cancelled(|job| engine.run_queued(&program, &server, 2, job));
}
