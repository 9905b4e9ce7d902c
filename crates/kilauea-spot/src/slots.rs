//! Slots: the places that answers come home to.

use std::num::NonZeroU32;

/// Names a slot in one round of its use.
///
/// A slot is used again and again. The round tells a late answer that its slot was dropped, and
/// maybe given to another question since. It wraps after 2^32 - 1 uses of the same slot. It is never
/// 0, so that a ticket that may be missing takes no more memory: SPOTs keep one for each answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ticket {
    pub(crate) slot: u32,
    pub(crate) round: NonZeroU32,
}

/// Slots for values of one type, and which SPOT each belongs to.
pub(crate) struct Slots<T> {
    slots: Vec<Slot<T>>,
    first_free: Option<u32>,
}

struct Slot<T> {
    round: NonZeroU32,
    state: SlotState<T>,
}

enum SlotState<T> {
    Free {
        next: Option<u32>,
    },
    Open {
        spot: u32,
    },
    /// Some of those who answer together are to be heard yet.
    Partial {
        spot: u32,
        n_open: u32,
        known: Option<T>,
    },
    Filled(T),
}

impl<T> Slots<T> {
    /// Memory that a slot takes.
    pub(crate) const BYTES: usize = size_of::<Slot<T>>();

    pub(crate) fn new() -> Self {
        Self {
            slots: Vec::new(),
            first_free: None,
        }
    }

    /// Opens a slot of `spot`.
    pub(crate) fn open(&mut self, spot: u32) -> Ticket {
        self.occupy(SlotState::Open { spot })
    }

    /// Opens a slot whose value is known.
    pub(crate) fn open_filled(&mut self, value: T) -> Ticket {
        self.occupy(SlotState::Filled(value))
    }

    fn occupy(&mut self, state: SlotState<T>) -> Ticket {
        let Some(idx) = self.first_free else {
            let round = NonZeroU32::MIN;
            self.slots.push(Slot { round, state });
            return Ticket {
                slot: (self.slots.len() - 1) as u32,
                round,
            };
        };
        let slot = &mut self.slots[idx as usize];
        if let SlotState::Free { next } = slot.state {
            self.first_free = next;
        }
        slot.state = state;
        Ticket {
            slot: idx,
            round: slot.round,
        }
    }

    /// Fills a slot and says whose it is. Nothing happens if it was dropped meanwhile, or filled
    /// already.
    pub(crate) fn fill(&mut self, ticket: Ticket, value: T) -> Option<u32> {
        let slot = self.slots.get_mut(ticket.slot as usize)?;
        match slot.state {
            SlotState::Open { spot } if slot.round == ticket.round => {
                slot.state = SlotState::Filled(value);
                Some(spot)
            }
            _ => None,
        }
    }

    /// Notes that so many values are to come that belong together, and what is known of them.
    pub(crate) fn expect(&mut self, ticket: Ticket, n_open: u32, known: Option<T>) {
        if let Some(slot) = self.current(ticket)
            && let SlotState::Open { spot } = slot.state
        {
            slot.state = SlotState::Partial {
                spot,
                n_open,
                known,
            };
        }
    }

    /// Like [`Self::fill`], where the slot may expect several values, which are combined as they
    /// come.
    pub(crate) fn fill_part(
        &mut self,
        ticket: Ticket,
        value: T,
        combine: impl FnOnce(T, T) -> T,
    ) -> Option<u32> {
        let slot = self.current(ticket)?;
        let SlotState::Partial {
            spot,
            n_open,
            known,
        } = &mut slot.state
        else {
            return self.fill(ticket, value);
        };
        let value = match known.take() {
            None => value,
            Some(before) => combine(before, value),
        };
        *n_open -= 1;
        if *n_open > 0 {
            *known = Some(value);
            return None;
        }
        let spot = *spot;
        slot.state = SlotState::Filled(value);
        Some(spot)
    }

    /// Takes the value out and frees the slot, if it is filled.
    pub(crate) fn take(&mut self, ticket: Ticket) -> Option<T> {
        let slot = self.current(ticket)?;
        if !matches!(slot.state, SlotState::Filled(_)) {
            return None;
        }
        match self.free(ticket.slot) {
            SlotState::Filled(value) => Some(value),
            _ => None,
        }
    }

    /// Frees a slot unread. Says whose it is if it was still open.
    pub(crate) fn discard(&mut self, ticket: Ticket) -> Option<u32> {
        self.current(ticket)?;
        match self.free(ticket.slot) {
            SlotState::Open { spot } | SlotState::Partial { spot, .. } => Some(spot),
            SlotState::Free { .. } | SlotState::Filled(_) => None,
        }
    }

    /// The slot that a ticket names, unless it was freed since.
    fn current(&mut self, ticket: Ticket) -> Option<&mut Slot<T>> {
        self.slots
            .get_mut(ticket.slot as usize)
            .filter(|slot| slot.round == ticket.round)
    }

    fn free(&mut self, idx: u32) -> SlotState<T> {
        let slot = &mut self.slots[idx as usize];
        slot.round = slot.round.checked_add(1).unwrap_or(NonZeroU32::MIN);
        let next = self.first_free.replace(idx);
        std::mem::replace(&mut slot.state, SlotState::Free { next })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What slots should do, without reuse of anything.
    #[derive(Clone, Copy, PartialEq, Debug)]
    enum Expected {
        Open,
        Filled,
        Gone,
    }

    /// Runs through every sequence of `depth` operations on up to three questions.
    fn check_all(ops: &mut Vec<(usize, usize)>, depth: usize, n_checked: &mut usize) {
        replay(ops);
        *n_checked += 1;
        if depth == 0 {
            return;
        }
        for op in 0..4 {
            for question in 0..3 {
                ops.push((op, question));
                check_all(ops, depth - 1, n_checked);
                ops.pop();
            }
        }
    }

    fn replay(ops: &[(usize, usize)]) {
        let mut slots = Slots::<usize>::new();
        let mut asked: Vec<(Ticket, Expected)> = Vec::new();
        for &(op, which) in ops {
            if op == 0 {
                if asked.len() == 3 {
                    continue;
                }
                let ticket = slots.open(asked.len() as u32);
                asked.push((ticket, Expected::Open));
                continue;
            }
            let Some(&(ticket, state)) = asked.get(which) else {
                continue;
            };
            let spot = which as u32;
            let after = match op {
                1 => {
                    let filled = slots.fill(ticket, 100 + which);
                    assert_eq!(filled, (state == Expected::Open).then_some(spot));
                    if state == Expected::Open {
                        Expected::Filled
                    } else {
                        state
                    }
                }
                2 => {
                    let taken = slots.take(ticket);
                    assert_eq!(taken, (state == Expected::Filled).then_some(100 + which));
                    if state == Expected::Filled {
                        Expected::Gone
                    } else {
                        state
                    }
                }
                _ => {
                    let discarded = slots.discard(ticket);
                    assert_eq!(discarded, (state == Expected::Open).then_some(spot));
                    Expected::Gone
                }
            };
            asked[which].1 = after;
        }
        let n_live = asked.iter().filter(|a| a.1 != Expected::Gone).count();
        let mut n_free = 0;
        let mut next = slots.first_free;
        while let Some(idx) = next {
            n_free += 1;
            let SlotState::Free { next: following } = slots.slots[idx as usize].state else {
                panic!("the free list holds a slot in use");
            };
            next = following;
        }
        assert_eq!(n_live + n_free, slots.slots.len());
    }

    #[test]
    fn every_order_of_asking_filling_taking_and_dropping() {
        let mut n_checked = 0;
        check_all(&mut Vec::new(), 5, &mut n_checked);
        assert!(n_checked > 12_usize.pow(5));
    }

    #[test]
    fn late_answers_go_nowhere() {
        let mut slots = Slots::new();
        let dropped = slots.open(0);
        assert_eq!(slots.discard(dropped), Some(0));
        let next = slots.open(1);
        assert_eq!(next.slot, dropped.slot, "the slot is used again");
        assert_eq!(slots.fill(dropped, "late"), None);
        assert_eq!(slots.fill(next, "right"), Some(1));
        assert_eq!(slots.take(next), Some("right"));
    }

    #[test]
    fn values_that_belong_together_fill_a_slot_with_the_last() {
        let sum = |a: u32, b: u32| a + b;
        for known in [None, Some(100)] {
            let mut slots = Slots::new();
            let ticket = slots.open(7);
            slots.expect(ticket, 2, known);
            assert_eq!(slots.fill_part(ticket, 10, sum), None);
            assert_eq!(slots.take(ticket), None);
            assert_eq!(slots.fill_part(ticket, 1, sum), Some(7));
            assert_eq!(slots.fill_part(ticket, 1, sum), None, "it is full");
            assert_eq!(slots.take(ticket), Some(11 + known.unwrap_or(0)));
            // One that was dropped between the two.
            let ticket = slots.open(8);
            slots.expect(ticket, 2, known);
            assert_eq!(slots.fill_part(ticket, 10, sum), None);
            assert_eq!(slots.discard(ticket), Some(8));
            assert_eq!(slots.fill_part(ticket, 1, sum), None);
            // And one that was dropped before anyone was asked.
            slots.expect(ticket, 2, known);
            assert_eq!(slots.open(9).slot, ticket.slot);
        }
    }
}
