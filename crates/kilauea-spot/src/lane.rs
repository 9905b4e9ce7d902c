//! What one engine thread knows of its SPOTs. No other thread sees it, so nothing here is locked.

use std::collections::HashMap;

use crate::budget::Budget;
use crate::departures::{Departures, Route};
use crate::engine::Limits;
use crate::exchange::{Child, Home};
use crate::priority::{PriorityQueue, Within};
use crate::program::Program;
use crate::queued::Started;
use crate::server::Server;
use crate::slots::{Slots, Ticket};

/// SPOTs of one thread, their slots, and what they have sent.
pub(crate) struct Lane<'r, P: Program> {
    thread: u32,
    /// Says what becomes of questions.
    server: &'r dyn Server<P>,
    /// The SPOT that is being run.
    current: u32,
    spots: Vec<Spot>,
    free_spots: Vec<u32>,
    answers: Slots<P::Answer>,
    outputs: Slots<P::Output>,
    /// Memory that a SPOT's cell takes, by pool.
    cell_bytes: Vec<usize>,
    /// SPOTs in condition ACTIVE.
    pub(crate) ready: PriorityQueue<u32>,
    /// Questions that were not sent yet.
    pub(crate) departures: Departures<P::Question>,
    /// Children of the SPOT that is being run.
    pub(crate) spawned: Vec<Child<P>>,
    /// Outputs of SPOTs that ended before children whose outputs they do not read.
    held_outputs: HashMap<u32, P::Output>,
    pub(crate) budget: Budget,
    pub(crate) n_questions: u64,
}

/// A SPOT's entry.
struct Spot {
    condition: Condition,
    /// Where its future is.
    started: Started,
    generation: u32,
    root: u64,
    /// Where the output goes; nowhere but to the job for a root.
    home: Option<Home>,
    /// Slots that are open and not dropped. With the last the SPOT becomes ACTIVE.
    n_open: u32,
    /// Children that have not come home, read or not.
    n_children: u32,
}

/// The paper's conditions of a SPOT (Kato & Saito 2002, 4.3), and one for the time between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Condition {
    /// Some slot is open.
    Wait,
    /// All slots are filled; it is queued to be run.
    Active,
    /// Its code is being run.
    Running,
    /// Its code has ended. The entry stays until the last child is home.
    Dead,
}

/// Who a SPOT is.
#[derive(Clone, Copy)]
pub(crate) struct Origin {
    pub(crate) generation: u32,
    pub(crate) root: u64,
    pub(crate) home: Option<Home>,
}

impl<'r, P: Program> Lane<'r, P> {
    /// Memory that a SPOT takes besides its cell.
    const SPOT_BYTES: usize = size_of::<Spot>() + size_of::<u32>();
    /// Memory of a question from its asking until the SPOT reads the answer.
    const QUESTION_BYTES: usize = Slots::<P::Answer>::BYTES
        + larger(
            size_of::<(Ticket, P::Question)>(),
            size_of::<(Ticket, P::Answer)>(),
        );
    /// Memory of a child besides that of its SPOT.
    const CHILD_BYTES: usize =
        Slots::<P::Output>::BYTES + larger(size_of::<Child<P>>(), size_of::<(Home, P::Output)>());

    pub(crate) fn new(thread: usize, limits: &Limits, server: &'r dyn Server<P>) -> Self {
        Self {
            thread: thread as u32,
            server,
            current: 0,
            spots: Vec::new(),
            free_spots: Vec::new(),
            answers: Slots::new(),
            outputs: Slots::new(),
            cell_bytes: Vec::new(),
            ready: PriorityQueue::new(limits.order, Within::Latest),
            departures: Departures::new(server.n_parts(), server.n_kinds()),
            spawned: Vec::new(),
            held_outputs: HashMap::new(),
            budget: Budget::new(limits.budget_bytes / limits.n_threads),
            n_questions: 0,
        }
    }

    /// Enters a SPOT, which becomes the current one. Its future is made after that, by code that may
    /// ask already.
    pub(crate) fn begin_spot(&mut self, origin: Origin) -> u32 {
        let spot = Spot {
            condition: Condition::Running,
            started: Started { pool: 0, cell: 0 },
            generation: origin.generation,
            root: origin.root,
            home: origin.home,
            n_open: 0,
            n_children: 0,
        };
        let idx = if let Some(idx) = self.free_spots.pop() {
            self.spots[idx as usize] = spot;
            idx
        } else {
            self.spots.push(spot);
            (self.spots.len() - 1) as u32
        };
        self.current = idx;
        idx
    }

    /// Notes where the future of a SPOT is, and counts the memory of both.
    pub(crate) fn charge_spot(&mut self, spot: u32, started: Started, cell_bytes: usize) {
        self.spots[spot as usize].started = started;
        let pool = started.pool as usize;
        if pool >= self.cell_bytes.len() {
            self.cell_bytes.resize(pool + 1, 0);
        }
        self.cell_bytes[pool] = cell_bytes;
        self.budget.begin_spot(Self::SPOT_BYTES + cell_bytes);
    }

    /// Makes a SPOT the current one, and says where its future is.
    pub(crate) fn resume(&mut self, spot: u32) -> Started {
        let entry = &mut self.spots[spot as usize];
        entry.condition = Condition::Running;
        self.current = spot;
        entry.started
    }

    /// Notes that a SPOT's code waits. False if nothing will ever wake it.
    pub(crate) fn suspend(&mut self, spot: u32) -> bool {
        let entry = &mut self.spots[spot as usize];
        entry.condition = Condition::Wait;
        entry.n_open > 0
    }

    /// Notes that a SPOT's code has ended. Returns its output, to be sent, once all its children
    /// are home.
    pub(crate) fn end_code(&mut self, spot: u32, output: P::Output) -> Option<(Origin, P::Output)> {
        let entry = &mut self.spots[spot as usize];
        entry.condition = Condition::Dead;
        if entry.n_children > 0 {
            self.held_outputs.insert(spot, output);
            return None;
        }
        Some((self.bury(spot), output))
    }

    /// Fills the slot of an answer, with the last of those that are combined.
    pub(crate) fn deliver_answer(&mut self, ticket: Ticket, answer: P::Answer) {
        let combine = |one, other| self.server.combine(one, other);
        if let Some(spot) = self.answers.fill_part(ticket, answer, combine) {
            self.close_slot(spot);
        }
    }

    /// Fills the slot of a child's output. Returns the parent's own output if it was held back for
    /// this child.
    pub(crate) fn deliver_output(
        &mut self,
        home: Home,
        output: P::Output,
    ) -> Option<(Origin, P::Output)> {
        if self.outputs.fill(home.ticket, output).is_some() {
            self.close_slot(home.spot);
        }
        let entry = &mut self.spots[home.spot as usize];
        entry.n_children -= 1;
        if entry.condition != Condition::Dead || entry.n_children > 0 {
            return None;
        }
        let held = self.held_outputs.remove(&home.spot)?;
        Some((self.bury(home.spot), held))
    }

    /// Opens a slot for the answer and sends the question to those who know. Where that is nobody but
    /// this thread the slot is filled at once, so that the SPOT need not wait for it.
    pub(crate) fn ask(&mut self, question: P::Question) -> Ticket {
        self.n_questions += 1;
        self.budget.begin_question(Self::QUESTION_BYTES);
        let (question, whom, known) = match self.server.route(question) {
            Route::Answered(answer) => return self.answers.open_filled(answer),
            Route::Asked {
                question,
                whom,
                known,
            } => (question, whom, known),
        };
        let ticket = self.answers.open(self.current);
        if known.is_some() || !whom.is_power_of_two() {
            self.answers.expect(ticket, whom.count_ones(), known);
        }
        self.spots[self.current as usize].n_open += 1;
        let kind = self.server.kind(&question);
        self.departures.add(ticket, question, kind, whom);
        ticket
    }

    /// Opens a slot for the output and spawns the child.
    pub(crate) fn spawn(&mut self, work: P::Work) -> Ticket {
        let ticket = self.outputs.open(self.current);
        let parent = &mut self.spots[self.current as usize];
        parent.n_open += 1;
        parent.n_children += 1;
        self.budget.charge(Self::CHILD_BYTES);
        self.spawned.push(Child {
            work,
            generation: parent.generation + 1,
            root: parent.root,
            home: Home {
                thread: self.thread,
                spot: self.current,
                ticket,
            },
        });
        ticket
    }

    /// Reads an answer.
    pub(crate) fn take_answer(&mut self, ticket: Ticket) -> Option<P::Answer> {
        let answer = self.answers.take(ticket)?;
        self.budget.end_question(Self::QUESTION_BYTES);
        Some(answer)
    }

    /// Reads the output of a child.
    pub(crate) fn take_output(&mut self, ticket: Ticket) -> Option<P::Output> {
        let output = self.outputs.take(ticket)?;
        self.budget.release(Self::CHILD_BYTES);
        Some(output)
    }

    /// Gives up an answer.
    pub(crate) fn discard_answer(&mut self, ticket: Ticket) {
        self.budget.end_question(Self::QUESTION_BYTES);
        if let Some(spot) = self.answers.discard(ticket) {
            self.spots[spot as usize].n_open -= 1;
        }
    }

    /// Gives up the output of a child.
    pub(crate) fn discard_output(&mut self, ticket: Ticket) {
        self.budget.release(Self::CHILD_BYTES);
        if let Some(spot) = self.outputs.discard(ticket) {
            self.spots[spot as usize].n_open -= 1;
        }
    }

    /// Counts a filled slot; the SPOT becomes ACTIVE with the last.
    fn close_slot(&mut self, spot: u32) {
        let entry = &mut self.spots[spot as usize];
        entry.n_open -= 1;
        if entry.n_open == 0 && entry.condition == Condition::Wait {
            entry.condition = Condition::Active;
            self.ready.push(entry.generation, entry.root, spot);
        }
    }

    /// Frees a SPOT's entry.
    fn bury(&mut self, spot: u32) -> Origin {
        let entry = &self.spots[spot as usize];
        let cell_bytes = self.cell_bytes[entry.started.pool as usize];
        self.budget.end_spot(Self::SPOT_BYTES + cell_bytes);
        self.free_spots.push(spot);
        Origin {
            generation: entry.generation,
            root: entry.root,
            home: entry.home,
        }
    }
}

const fn larger(a: usize, b: usize) -> usize {
    if a > b { a } else { b }
}
