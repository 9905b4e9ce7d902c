//! The way to one of all lights, fork by fork.

use kilauea_gather::{CellChoice, ChoiceField, PLAIN_CHOICES, Turn};

use super::Receiver;

/// Knows how to choose lights at each place.
pub(crate) trait LightChooser: Copy + Send + Sync {
    /// A way to a light.
    type Walk: LightWalk;

    /// A way that begins at a place.
    fn walk(&self, receiver: Receiver) -> Self::Walk;
}

/// A way to a light: it keeps its own probability.
pub(crate) trait LightWalk {
    /// Uses up what it needs of a uniform number, if it is to be drawn by one.
    fn begin(&mut self, u: f32) -> f32;

    /// Goes on at a fork whose first way has the probability `first` by what lights could bring if
    /// nothing were in between. `takes_second` decides by the probability of the first way that
    /// counts.
    fn turn(&mut self, fork: u32, first: f32, takes_second: impl FnOnce(f32) -> bool) -> bool;

    /// Probability of all of its turns.
    fn probability(&self) -> f32;
}

/// Chooses by what lights could bring if nothing were in between.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ByImportance;

/// A way by importance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ImportanceWalk {
    probability: f32,
}

/// Chooses by what earlier paths found lights to bring in each cell, and now and then by importance,
/// so that no light is forgotten.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ByCells<'a> {
    /// None where importance has to do.
    pub(crate) field: Option<&'a ChoiceField>,
}

/// A way by what is known of a cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellWalk<'a> {
    cell: Option<CellChoice<'a>>,
    /// Whether this one is drawn by importance. Without a cell it is as an [`ImportanceWalk`], bit for
    /// bit.
    is_plain: bool,
    by_importance: f32,
    by_cell: f32,
}

impl ImportanceWalk {
    pub(super) const START: Self = Self { probability: 1.0 };
}

impl LightChooser for ByImportance {
    type Walk = ImportanceWalk;

    #[inline(always)]
    fn walk(&self, _: Receiver) -> ImportanceWalk {
        ImportanceWalk::START
    }
}

impl LightWalk for ImportanceWalk {
    #[inline(always)]
    fn begin(&mut self, u: f32) -> f32 {
        u
    }

    #[inline(always)]
    fn turn(&mut self, _: u32, first: f32, takes_second: impl FnOnce(f32) -> bool) -> bool {
        let is_second = takes_second(first);
        self.probability *= of_way(first, is_second);
        is_second
    }

    #[inline(always)]
    fn probability(&self) -> f32 {
        self.probability
    }
}

impl ByCells<'_> {
    /// Nothing is known.
    pub(crate) const BLIND: Self = Self { field: None };
}

impl<'a> LightChooser for ByCells<'a> {
    type Walk = CellWalk<'a>;

    #[inline]
    fn walk(&self, receiver: Receiver) -> CellWalk<'a> {
        let cell = self.field.map(|field| field.at(receiver.p, receiver.n));
        CellWalk {
            cell,
            is_plain: cell.is_none(),
            by_importance: 1.0,
            by_cell: 1.0,
        }
    }
}

impl LightWalk for CellWalk<'_> {
    #[inline]
    fn begin(&mut self, u: f32) -> f32 {
        if self.cell.is_none() {
            return u;
        }
        self.is_plain = u < PLAIN_CHOICES;
        if self.is_plain {
            u / PLAIN_CHOICES
        } else {
            (u - PLAIN_CHOICES) / (1.0 - PLAIN_CHOICES)
        }
    }

    #[inline]
    fn turn(&mut self, fork: u32, first: f32, takes_second: impl FnOnce(f32) -> bool) -> bool {
        let by_cell = self.cell.map_or(first, |cell| cell.first(fork, first));
        let is_second = takes_second(if self.is_plain { first } else { by_cell });
        self.by_importance *= of_way(first, is_second);
        self.by_cell *= of_way(by_cell, is_second);
        is_second
    }

    #[inline]
    fn probability(&self) -> f32 {
        if self.cell.is_none() {
            return self.by_importance;
        }
        PLAIN_CHOICES * self.by_importance + (1.0 - PLAIN_CHOICES) * self.by_cell
    }
}

/// Probability of one of two ways.
#[inline]
fn of_way(first: f32, is_second: bool) -> f32 {
    if is_second { 1.0 - first } else { first }
}

/// Takes one of two ways by a uniform number, and leaves another one.
#[inline]
pub(super) fn takes_second(u: &mut f32, first: f32) -> bool {
    let is_second = *u >= first;
    *u = if is_second {
        (*u - first) / (1.0 - first)
    } else {
        *u / first
    };
    *u = u.min(1.0 - f32::EPSILON);
    is_second
}

/// A way by importance whose turns are noted.
pub(super) struct NotedWalk(pub(super) Vec<Turn>);

impl LightWalk for NotedWalk {
    fn begin(&mut self, u: f32) -> f32 {
        u
    }

    fn turn(&mut self, fork: u32, first: f32, takes_second: impl FnOnce(f32) -> bool) -> bool {
        let took_second = takes_second(first);
        self.0.push(Turn {
            fork,
            first,
            took_second,
        });
        took_second
    }

    fn probability(&self) -> f32 {
        let ways = self
            .0
            .iter()
            .map(|turn| of_way(turn.first, turn.took_second));
        ways.product()
    }
}
