//! Starts the threads of a run and brings its outcome back.

use std::any::Any;
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::thread::{Builder, Scope, ScopedJoinHandle, scope};
use std::time::Instant;

use crate::error::{RunError, panic_message};
use crate::exchange::{Exchange, Progress};
use crate::inline::{Inline, Stuck};
use crate::priority::Order;
use crate::program::{Answerer, Job, Program};
use crate::server::{Desk, Server};
use crate::stats::{Stats, ThreadStats};
use crate::thread::run_thread;

/// Runs programs of SPOTs. Built with its limits; each run has threads of its own.
#[derive(Clone, Debug)]
pub struct Engine {
    limits: Limits,
}

/// Limits of a run.
#[derive(Clone, Debug)]
pub(crate) struct Limits {
    pub(crate) n_threads: usize,
    pub(crate) budget_bytes: usize,
    pub(crate) questions_out: usize,
    pub(crate) batch_len: usize,
    pub(crate) stack_bytes: usize,
    pub(crate) order: Order,
}

impl Engine {
    /// An engine of `n_threads` threads, at least one; best as many as cores.
    pub fn new(n_threads: usize) -> Self {
        Self {
            limits: Limits {
                n_threads: n_threads.max(1),
                budget_bytes: 256 << 20,
                questions_out: 1 << 16,
                batch_len: 256,
                stack_bytes: 8 << 20,
                order: Order::default(),
            },
        }
    }

    /// Bytes that SPOTs in flight may take, all threads together. Split evenly between threads,
    /// and exceeded only by what as many roots as there are threads lead to.
    #[must_use]
    pub fn budget_bytes(mut self, bytes: usize) -> Self {
        self.limits.budget_bytes = bytes;
        self
    }

    /// Questions that one thread may have under way, at least one. What it asks beyond that waits
    /// in the thread until answers come.
    #[must_use]
    pub fn questions_out(mut self, n: usize) -> Self {
        self.limits.questions_out = n.max(1);
        self
    }

    /// Questions that travel together, at least one. A thread that has nothing else to do sends
    /// fewer.
    #[must_use]
    pub fn batch_len(mut self, n: usize) -> Self {
        self.limits.batch_len = n.max(1);
        self
    }

    /// Stack of each engine thread. Where questions are answered inline, a child takes stack for
    /// as long as it runs, so depth needs stack.
    #[must_use]
    pub fn stack_bytes(mut self, bytes: usize) -> Self {
        self.limits.stack_bytes = bytes;
        self
    }

    /// Which work goes first.
    #[must_use]
    pub fn order(mut self, order: Order) -> Self {
        self.limits.order = order;
        self
    }

    /// Runs all roots of `job`; questions are answered and children run inside the call. Nothing
    /// waits, so the budget does not matter.
    pub fn run_inline<P, A, J>(&self, program: &P, answerer: &A, job: &J) -> Result<Stats, RunError>
    where
        P: Program,
        A: Answerer<P>,
        J: Job<P>,
    {
        let progress = Progress::new();
        let fail = |error| progress.end(Some(error));
        let run = |_| run_thread_inline(program, answerer, job, &progress);
        let start = Instant::now();
        let threads = scope(|threads| self.join_engine_threads(threads, &run, &fail));
        outcome(&progress, threads, start)
    }

    /// Runs all roots of `job`; questions go to `server` on `n_servers` threads, at least one.
    pub fn run_queued<P, S, J>(
        &self,
        program: &P,
        server: &S,
        n_servers: usize,
        job: &J,
    ) -> Result<Stats, RunError>
    where
        P: Program,
        S: Server<P> + ?Sized,
        J: Job<P>,
    {
        let n_servers = n_servers.max(1);
        let exchange = Exchange::new(&self.limits);
        let fail = |error| exchange.end(Some(error));
        let serve = || server.serve(&Desk::new(&exchange));
        let run = |thread| run_thread(thread, program, job, &exchange, &self.limits);
        let start = Instant::now();
        let threads = scope(|threads| {
            for i in 0..n_servers {
                spawn(
                    threads,
                    format!("answers {i}"),
                    Builder::new(),
                    &fail,
                    serve,
                );
            }
            self.join_engine_threads(threads, &run, &fail)
        });
        outcome(&exchange.progress, threads, start)
    }

    /// Runs engine threads to their end.
    fn join_engine_threads<'scope>(
        &self,
        threads: &'scope Scope<'scope, '_>,
        run: &'scope (impl Fn(usize) -> ThreadStats + Sync),
        fail: &'scope (impl Fn(RunError) + Sync),
    ) -> Vec<ThreadStats> {
        let start = |thread| {
            let builder = Builder::new().stack_size(self.limits.stack_bytes);
            spawn(
                threads,
                format!("spot {thread}"),
                builder,
                fail,
                move || run(thread),
            )
        };
        // All threads start before the first is waited for.
        let handles: Vec<_> = (0..self.limits.n_threads).map(start).collect();
        let join = |handle: ScopedJoinHandle<'_, Option<ThreadStats>>| handle.join().ok()?;
        handles.into_iter().flatten().filter_map(join).collect()
    }
}

/// Starts a thread whose panic, or whose lack, fails the run.
fn spawn<'scope, T: Send + 'scope>(
    threads: &'scope Scope<'scope, '_>,
    name: String,
    builder: Builder,
    fail: &'scope (impl Fn(RunError) + Sync),
    run: impl FnOnce() -> T + Send + 'scope,
) -> Option<ScopedJoinHandle<'scope, Option<T>>> {
    let thread = name.clone();
    let guarded = move || match catch_unwind(AssertUnwindSafe(run)) {
        Ok(result) => Some(result),
        Err(payload) => {
            let message = panic_message(payload.as_ref());
            fail(RunError::ThreadPanicked { thread, message });
            None
        }
    };
    let spawned = builder.name(name.clone()).spawn_scoped(threads, guarded);
    spawned
        .map_err(|error| {
            fail(RunError::NoThread {
                thread: name,
                message: error.to_string(),
            });
        })
        .ok()
}

fn outcome(
    progress: &Progress,
    threads: Vec<ThreadStats>,
    start: Instant,
) -> Result<Stats, RunError> {
    let wall = start.elapsed();
    progress
        .take_error()
        .map_or(Ok(Stats { threads, wall }), Err)
}

/// Does root after root until there are none.
fn run_thread_inline<P, A, J>(
    program: &P,
    answerer: &A,
    job: &J,
    progress: &Progress,
) -> ThreadStats
where
    P: Program,
    A: Answerer<P>,
    J: Job<P>,
{
    let start = Instant::now();
    let failed = Cell::new(None);
    let inline = Inline::new(program, answerer, &failed);
    let mut stats = ThreadStats::default();
    while !progress.has_ended() {
        if job.is_cancelled() {
            progress.end(Some(RunError::Cancelled));
            break;
        }
        let number = progress.next_number();
        let Some(work) = job.root(number) else {
            break;
        };
        match catch_unwind(AssertUnwindSafe(|| inline.run(work))) {
            Ok(output) => job.done(number, output),
            Err(payload) => {
                progress.end(Some(blame(failed.get(), payload.as_ref())));
                break;
            }
        }
        stats.n_roots += 1;
    }
    stats.total = start.elapsed();
    stats
}

/// The error for a panic whose innermost SPOT is `label`.
fn blame(label: Option<&str>, payload: &(dyn Any + Send)) -> RunError {
    let label = label.unwrap_or("the choice of a SPOT's code").to_owned();
    if payload.is::<Stuck>() {
        RunError::Stuck { label }
    } else {
        RunError::Panicked {
            label,
            message: panic_message(payload),
        }
    }
}
