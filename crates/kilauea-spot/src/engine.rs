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
        let start = Instant::now();
        let threads = self.run_threads(&Threads {
            n_servers: 0,
            serve: &|| {},
            run: &|_| run_thread_inline(program, answerer, job, &progress),
            fail: &|error| progress.end(Some(error)),
        });
        outcome(&progress, threads, start)
    }

    /// Runs all roots of `job`; questions go to `server` on `n_servers` threads, at least one.
    pub fn run_queued<P, J>(
        &self,
        program: &P,
        server: &dyn Server<P>,
        n_servers: usize,
        job: &J,
    ) -> Result<Stats, RunError>
    where
        P: Program,
        J: Job<P>,
    {
        let exchange = Exchange::new(&self.limits, server.n_parts());
        let start = Instant::now();
        let threads = self.run_threads(&Threads {
            n_servers: n_servers.max(1),
            serve: &|| server.serve(&Desk::new(&exchange)),
            run: &|thread| run_thread(thread, program, job, server, &exchange, &self.limits),
            fail: &|error| exchange.end(Some(error)),
        });
        outcome(&exchange.progress, threads, start)
    }

    /// Runs all threads to their end, and brings what the engine's own say.
    fn run_threads(&self, threads: &Threads<'_>) -> Vec<ThreadStats> {
        let Threads { serve, run, .. } = *threads;
        scope(|scope| {
            for i in 0..threads.n_servers {
                threads.spawn(
                    scope,
                    format!("answers {i}"),
                    Builder::new(),
                    Box::new(serve),
                );
            }
            let start = |thread| {
                let builder = Builder::new().stack_size(self.limits.stack_bytes);
                let run = Box::new(move || run(thread));
                threads.spawn(scope, format!("spot {thread}"), builder, run)
            };
            // All threads start before the first is waited for.
            let handles: Vec<_> = (0..self.limits.n_threads).map(start).collect();
            let join = |handle: ScopedJoinHandle<'_, Option<ThreadStats>>| handle.join().ok()?;
            handles.into_iter().flatten().filter_map(join).collect()
        })
    }
}

/// What the threads of a run do. Behind pointers, since programs are many and starting threads takes
/// more code than most of them.
struct Threads<'a> {
    n_servers: usize,
    serve: &'a (dyn Fn() + Sync),
    run: &'a (dyn Fn(usize) -> ThreadStats + Sync),
    fail: &'a (dyn Fn(RunError) + Sync),
}

impl Threads<'_> {
    /// Starts a thread whose panic, or whose lack, fails the run.
    fn spawn<'scope, T: Send + 'scope>(
        &'scope self,
        scope: &'scope Scope<'scope, '_>,
        name: String,
        builder: Builder,
        run: Box<dyn FnOnce() -> T + Send + 'scope>,
    ) -> Option<ScopedJoinHandle<'scope, Option<T>>> {
        let thread = name.clone();
        let guarded = move || match catch_unwind(AssertUnwindSafe(run)) {
            Ok(result) => Some(result),
            Err(payload) => {
                let message = panic_message(payload.as_ref());
                (self.fail)(RunError::ThreadPanicked { thread, message });
                None
            }
        };
        let spawned = builder.name(name.clone()).spawn_scoped(scope, guarded);
        spawned
            .map_err(|error| {
                (self.fail)(RunError::NoThread {
                    thread: name,
                    message: error.to_string(),
                });
            })
            .ok()
    }
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
