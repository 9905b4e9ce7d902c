//! Slow questions keep nobody waiting but those who asked them.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use kilauea_spot::{Answerer, Context, Engine, Job, Pool, Program, Queue, RunError, Runtime};

const N_FAST: usize = 1000;

/// Each root asks one question; that of root 0 is slow.
struct OneEach;

impl Program for OneEach {
    type Work = usize;
    type Output = usize;
    type Question = usize;
    type Answer = usize;

    fn starter<'a, R: Runtime<'a, Self>>(
        &'a self,
        runtime: &R,
    ) -> impl Fn(usize, R::Context) -> R::Started {
        let roots = runtime.pool("root");
        move |number, cx: R::Context| roots.start(async move { cx.ask(number).await })
    }
}

/// The slow answer takes until the last fast one is given.
struct Patient {
    n_fast: AtomicUsize,
    all_fast: (SyncSender<()>, Mutex<Receiver<()>>),
    has_patience: bool,
}

impl Patient {
    fn new(has_patience: bool) -> Self {
        let (sender, receiver) = sync_channel(1);
        Self {
            n_fast: AtomicUsize::new(0),
            all_fast: (sender, Mutex::new(receiver)),
            has_patience,
        }
    }
}

impl Answerer<OneEach> for Patient {
    fn answer(&self, number: usize) -> usize {
        if number > 0 {
            if self.n_fast.fetch_add(1, Ordering::Relaxed) + 1 == N_FAST {
                self.all_fast.0.send(()).expect("somebody waits");
            }
            return number;
        }
        assert!(self.has_patience, "no such tile");
        let all_fast = self.all_fast.1.lock();
        let all_fast = all_fast.unwrap_or_else(PoisonError::into_inner);
        let minute = Duration::from_mins(1);
        all_fast.recv_timeout(minute).map_or(usize::MAX, |()| 0)
    }

    fn is_slow(&self, number: &usize) -> bool {
        *number == 0
    }
}

struct Roots(Mutex<Vec<usize>>);

impl Job<OneEach> for Roots {
    fn root(&self, number: u64) -> Option<usize> {
        (number <= N_FAST as u64).then_some(number as usize)
    }

    fn done(&self, _: u64, output: usize) {
        self.0.lock().expect("no job panics").push(output);
    }
}

#[test]
fn one_server_thread_answers_the_rest_meanwhile() {
    let job = Roots(Mutex::default());
    let patient = Patient::new(true);
    let run = Engine::new(2).run_queued(&OneEach, &Queue::new(&patient), 1, &job);
    assert!(run.is_ok());
    let mut found = job.0.into_inner().expect("no job panics");
    found.sort_unstable();
    assert!(found.into_iter().eq(0..=N_FAST));
}

#[test]
fn a_slow_answer_that_panics_ends_the_run() {
    let job = Roots(Mutex::default());
    let hasty = Patient::new(false);
    let run = Engine::new(2).run_queued(&OneEach, &Queue::new(&hasty), 1, &job);
    match run {
        Err(RunError::ThreadPanicked { message, .. }) => assert_eq!(message, "no such tile"),
        other => panic!("{other:?}"),
    }
}
