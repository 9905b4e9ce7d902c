//! Questions of one engine thread on their way out: each by those that it goes to, until there are
//! enough of a kind to travel together.

use crate::program::Program;
use crate::slots::Ticket;

/// What becomes of a question.
pub enum Route<P: Program> {
    /// The thread that asks knows the answer by itself.
    Answered(P::Answer),
    /// Others are asked.
    Asked {
        /// What they are asked, which may be less than what was asked at first.
        question: P::Question,
        /// Those who are, one bit each; at least one.
        whom: u64,
        /// Part of the answer, with which theirs are combined.
        known: Option<P::Answer>,
    },
}

/// Questions to one holder, all of a kind.
pub(crate) struct Line<Q> {
    pub(crate) part: usize,
    pub(crate) questions: Vec<(Ticket, Q)>,
}

/// The lines of an engine thread. Bounded by the open slots of SPOTs in flight.
pub(crate) struct Departures<Q> {
    lines: Vec<Line<Q>>,
    n_kinds: usize,
}

impl<Q> Departures<Q> {
    pub(crate) fn new(n_parts: usize, n_kinds: usize) -> Self {
        let line = |i| Line {
            part: i / n_kinds,
            questions: Vec::new(),
        };
        Self {
            lines: (0..n_parts * n_kinds).map(line).collect(),
            n_kinds,
        }
    }

    /// Adds a question to the lines of all whom it goes to.
    pub(crate) fn add(&mut self, ticket: Ticket, question: Q, kind: usize, whom: u64)
    where
        Q: Clone,
    {
        let mut rest = whom;
        while rest != 0 {
            let part = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            let line = &mut self.lines[part * self.n_kinds + kind];
            line.questions.push((ticket, question.clone()));
        }
    }

    /// Questions in all lines.
    pub(crate) fn n_waiting(&self) -> usize {
        self.lines.iter().map(|line| line.questions.len()).sum()
    }

    /// The lines in which so many wait, at least one.
    pub(crate) fn lines_of(&mut self, least: usize) -> impl Iterator<Item = &mut Line<Q>> {
        let is_long = move |line: &&mut Line<Q>| line.questions.len() >= least.max(1);
        self.lines.iter_mut().filter(is_long)
    }
}
