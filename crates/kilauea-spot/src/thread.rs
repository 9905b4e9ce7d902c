//! An engine thread: takes the most urgent work, runs it until it waits or ends, and repeats.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::rc::Rc;
use std::task::Poll;
use std::time::Instant;

use crate::budget::Pressure;
use crate::engine::Limits;
use crate::error::{RunError, panic_message};
use crate::exchange::{Batch, Child, Exchange, Mail};
use crate::lane::{Lane, Origin};
use crate::priority::Order;
use crate::program::{Job, Program};
use crate::queued::{Queued, QueuedContext, Started};
use crate::server::Server;
use crate::stats::ThreadStats;

/// What an engine thread works with. `S` starts SPOTs.
struct EngineThread<'a, 'e, P: Program, J, S> {
    thread: usize,
    exchange: &'e Exchange<P>,
    job: &'e J,
    server: &'e dyn Server<P>,
    limits: &'e Limits,
    /// Questions of a full batch.
    batch_len: usize,
    lane: Rc<RefCell<Lane<'a, P>>>,
    runtime: Queued<'a, P>,
    starter: S,
    /// Questions sent and not answered; never above the credit.
    n_questions_out: usize,
    mail: Vec<Mail<P>>,
    privileged: Vec<u64>,
    stats: ThreadStats,
}

/// What to do next.
enum Task<P: Program> {
    Resume(u32),
    StartChild(Child<P>),
    StartRoot(u64, P::Work),
}

/// Runs SPOTs on thread number `thread` until the run ends.
pub(crate) fn run_thread<'a, P: Program, J: Job<P>>(
    thread: usize,
    program: &'a P,
    job: &J,
    server: &'a dyn Server<P>,
    exchange: &Exchange<P>,
    limits: &Limits,
) -> ThreadStats {
    let lane = Rc::new(RefCell::new(Lane::new(thread, limits, server)));
    let runtime = Queued::new(Rc::clone(&lane));
    let starter = program.starter(&runtime);
    let start = Instant::now();
    let mut engine_thread = EngineThread {
        thread,
        exchange,
        job,
        server,
        limits,
        batch_len: server.full_batch().unwrap_or(limits.batch_len),
        lane,
        // The same pools: `starter` has typed handles to them.
        runtime: runtime.share(),
        starter,
        n_questions_out: 0,
        mail: Vec::new(),
        privileged: Vec::new(),
        stats: ThreadStats::default(),
    };
    engine_thread.run();
    engine_thread.finish_stats(start)
}

impl<'a, P, J, S> EngineThread<'a, '_, P, J, S>
where
    P: Program + 'a,
    J: Job<P>,
    S: Fn(P::Work, QueuedContext<'a, P>) -> Started,
{
    fn run(&mut self) {
        while !self.exchange.progress.has_ended() {
            if self.job.is_cancelled() {
                self.exchange.end(Some(RunError::Cancelled));
                break;
            }
            self.read_mail();
            match self.choose() {
                Some(task) => self.perform(task),
                None => self.wait(),
            }
            self.send_batches(self.batch_len);
        }
    }

    fn read_mail(&mut self) {
        let mut mail = std::mem::take(&mut self.mail);
        self.exchange.inboxes[self.thread].take(&mut mail);
        for letter in mail.drain(..) {
            match letter {
                Mail::Answers(answers) => {
                    self.n_questions_out = self.n_questions_out.saturating_sub(answers.len());
                    let mut lane = self.lane.borrow_mut();
                    for (ticket, answer) in answers {
                        lane.deliver_answer(ticket, answer);
                    }
                }
                Mail::Output(home, output) => {
                    self.exchange.backlogs[self.thread].give_back(1);
                    let ended = self.lane.borrow_mut().deliver_output(home, output);
                    if let Some((origin, output)) = ended {
                        self.send_output(origin, output);
                    }
                }
            }
        }
        self.mail = mail;
    }

    /// The most urgent thing that the pressure on memory allows.
    fn choose(&mut self) -> Option<Task<P>> {
        let mut lane = self.lane.borrow_mut();
        if self.limits.order == Order::FirstCome {
            let may_admit = lane.budget.is_within_share();
            drop(lane);
            return self.choose_first_come(may_admit);
        }
        let pressure = lane.budget.pressure();
        let n_waiting = self.n_questions_out + lane.departures.n_waiting();
        let may_admit = lane.budget.may_admit() && self.has_room_for_questions(n_waiting);
        let backlog = &self.exchange.backlogs[self.thread];
        if pressure <= Pressure::Resume {
            let urgency = lane.ready.urgency();
            if pressure <= Pressure::Start
                && let Some(child) = backlog.pop_above(urgency)
            {
                return Some(Task::StartChild(child));
            }
            if let Some(spot) = lane.ready.pop() {
                return Some(Task::Resume(spot));
            }
        }
        drop(lane);
        if pressure > Pressure::Start {
            return self.choose_privileged();
        }
        if may_admit
            && self.job.has_root()
            && let Some(root) = self.admit()
        {
            return Some(root);
        }
        self.exchange.steal(self.thread).map(Task::StartChild)
    }

    fn choose_first_come(&mut self, may_admit: bool) -> Option<Task<P>> {
        if may_admit
            && self.job.has_root()
            && let Some(task) = self.admit()
        {
            return Some(task);
        }
        if let Some(spot) = self.lane.borrow_mut().ready.pop() {
            return Some(Task::Resume(spot));
        }
        self.exchange.backlogs[self.thread]
            .pop_above(0)
            .or_else(|| self.exchange.steal(self.thread))
            .map(Task::StartChild)
    }

    /// Work of a privileged root, or of the oldest root here if this thread gave no privilege yet.
    fn choose_privileged(&mut self) -> Option<Task<P>> {
        let privileges = &self.exchange.privileges;
        privileges.list(&mut self.privileged);
        if let Some(task) = self.take_privileged() {
            return Some(task);
        }
        if privileges.has(self.thread) {
            return None;
        }
        let backlog = &self.exchange.backlogs[self.thread];
        let of_ready = self.lane.borrow().ready.oldest_set_aside();
        let oldest = [of_ready, backlog.oldest_set_aside()];
        let root = oldest.into_iter().flatten().min()?;
        self.exchange.privilege(self.thread, root);
        self.privileged.push(root);
        self.take_privileged()
    }

    fn take_privileged(&mut self) -> Option<Task<P>> {
        let ready = self.lane.borrow_mut().ready.pop_of(&self.privileged);
        if let Some(spot) = ready {
            return Some(Task::Resume(spot));
        }
        self.exchange.backlogs[self.thread]
            .pop_of(&self.privileged)
            .map(Task::StartChild)
    }

    fn admit(&mut self) -> Option<Task<P>> {
        let progress = &self.exchange.progress;
        let number = progress.reserve()?;
        if let Some(work) = self.job.root(number) {
            self.lane.borrow_mut().budget.begin_root();
            return Some(Task::StartRoot(number, work));
        }
        progress.exhaust();
        if progress.release() {
            self.exchange.end(None);
        }
        None
    }

    fn perform(&mut self, task: Task<P>) {
        match task {
            Task::Resume(spot) => {
                self.stats.n_resumed += 1;
                let started = self.lane.borrow_mut().resume(spot);
                self.run_spot(spot, started);
            }
            Task::StartChild(child) => {
                if child.home.thread as usize != self.thread {
                    self.stats.n_stolen += 1;
                }
                let origin = Origin {
                    generation: child.generation,
                    root: child.root,
                    home: Some(child.home),
                };
                self.start(origin, child.work);
            }
            Task::StartRoot(root, work) => {
                let origin = Origin {
                    generation: 0,
                    root,
                    home: None,
                };
                self.start(origin, work);
            }
        }
    }

    fn start(&mut self, origin: Origin, work: P::Work) {
        self.stats.n_spots += 1;
        let spot = self.lane.borrow_mut().begin_spot(origin);
        let started = (self.starter)(work, self.runtime.context());
        let cell_bytes = self.runtime.cell_bytes(started);
        let mut lane = self.lane.borrow_mut();
        lane.charge_spot(spot, started, cell_bytes);
        drop(lane);
        self.run_spot(spot, started);
    }

    /// Runs the current SPOT until it waits or ends.
    fn run_spot(&mut self, spot: u32, started: Started) {
        let runtime = &self.runtime;
        let polled = catch_unwind(AssertUnwindSafe(|| runtime.poll(started)));
        self.publish_children();
        match polled {
            Ok(Poll::Pending) => {
                if !self.lane.borrow_mut().suspend(spot) {
                    let label = self.runtime.label(started).to_owned();
                    self.exchange.end(Some(RunError::Stuck { label }));
                }
            }
            Ok(Poll::Ready(output)) => {
                let ended = self.lane.borrow_mut().end_code(spot, output);
                if let Some((origin, output)) = ended {
                    self.send_output(origin, output);
                }
            }
            Err(payload) => self.exchange.end(Some(RunError::Panicked {
                label: self.runtime.label(started).to_owned(),
                message: panic_message(payload.as_ref()),
            })),
        }
    }

    /// Moves the children of the SPOT that just ran to where others can steal them.
    fn publish_children(&mut self) {
        let mut lane = self.lane.borrow_mut();
        let Some(first) = lane.spawned.first() else {
            return;
        };
        let (generation, root) = (first.generation, first.root);
        self.exchange.backlogs[self.thread].push(generation, root, lane.spawned.drain(..));
        self.exchange.offer();
    }

    /// Sends the output of a dead SPOT to its parent, or to the job. Parents here may have ended
    /// before and send their own output in turn.
    fn send_output(&mut self, mut origin: Origin, mut output: P::Output) {
        loop {
            let Some(home) = origin.home else {
                self.stats.n_roots += 1;
                self.lane.borrow_mut().budget.end_root();
                self.job.done(origin.root, output);
                self.exchange.end_root(origin.root);
                return;
            };
            let owner = home.thread as usize;
            if owner != self.thread {
                self.exchange.inboxes[owner].put(Mail::Output(home, output));
                return;
            }
            let ended = self.lane.borrow_mut().deliver_output(home, output);
            let Some(next) = ended else { return };
            (origin, output) = next;
        }
    }

    /// Whether more questions than those that wait would make batches fuller. Beyond as many as fill one
    /// to each holder, SPOTs that wait take room in caches from those that run.
    fn has_room_for_questions(&self, n_waiting: usize) -> bool {
        let full = self.server.full_batch();
        full.is_none_or(|full| n_waiting < full * self.server.n_parts())
    }

    /// Sends batches of at least so many questions, as the credit allows. Those that are not full go to
    /// holders who can be asked at once: elsewhere they would wait, and may as well grow until answers
    /// to this thread come.
    fn send_batches(&mut self, least: usize) {
        let Self {
            lane,
            exchange,
            limits,
            batch_len,
            n_questions_out,
            server,
            ..
        } = self;
        for line in lane.borrow_mut().departures.lines_of(least) {
            let n_unanswered = || exchange.questions[line.part].n_unanswered();
            let may_grow = line.questions.len() < *batch_len && *n_questions_out > 0;
            if may_grow && n_unanswered() >= server.n_batches_out(line.part) {
                continue;
            }
            while line.questions.len() >= least.max(1) {
                let credit = limits.questions_out - *n_questions_out;
                let n = line.questions.len().min(*batch_len).min(credit);
                if n == 0 {
                    return;
                }
                *n_questions_out += n;
                // With room for as many again, so that it need not move as it grows.
                let mut rest = Vec::with_capacity(n);
                rest.extend(line.questions.drain(n..));
                let questions = std::mem::replace(&mut line.questions, rest);
                exchange.questions[line.part].push(Batch {
                    thread: self.thread as u32,
                    questions,
                });
            }
        }
    }

    /// Nothing to do: sends what is left, then waits for mail or something to steal.
    fn wait(&mut self) {
        // Answers that are under way lead to more questions, which can make a batch full.
        if self
            .server
            .full_batch()
            .is_none_or(|full| self.n_questions_out < full)
        {
            self.send_batches(1);
        }
        let is_starved = !self.exchange.progress.is_exhausted();
        let is_short_of_memory = self.lane.borrow().budget.pressure() > Pressure::Admit;
        let start = Instant::now();
        let may_start = self.limits.order == Order::FirstCome
            || self.lane.borrow().budget.pressure() <= Pressure::Start;
        let child = if may_start {
            self.exchange.wait_for_mail_or_child(self.thread)
        } else {
            self.exchange.wait_for_mail(self.thread);
            None
        };
        let waited = start.elapsed();
        if is_starved {
            self.stats.starved += waited;
            if is_short_of_memory {
                self.stats.starved_of_memory += waited;
            }
        } else {
            self.stats.waited_for_end += waited;
        }
        if let Some(child) = child {
            self.perform(Task::StartChild(child));
        }
    }

    fn finish_stats(mut self, start: Instant) -> ThreadStats {
        let lane = self.lane.borrow();
        self.stats.n_questions = lane.n_questions;
        self.stats.peak_bytes = lane.budget.peak_bytes();
        self.stats.peak_spots = lane.budget.peak_spots();
        self.stats.questions_at_peak = lane.budget.questions_at_peak();
        self.stats.n_cells = self.runtime.n_cells();
        self.stats.total = start.elapsed();
        drop(lane);
        self.stats
    }
}
