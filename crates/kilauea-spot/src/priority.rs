//! The order in which work is taken: highest generation first (Kato & Saito 2002, 4.2).

use std::collections::{BTreeMap, VecDeque};

/// Which work goes first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// The highest generation; new roots only when nothing else can be done. The work of a root
    /// comes to an end before others begin, so few SPOTs are in flight.
    #[default]
    HighestGeneration,
    /// First come, first served, roots included. It is here to measure the rule above: memory
    /// grows with everything that the admitted roots lead to.
    FirstCome,
}

/// Which work goes first of one generation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Within {
    /// What has waited longest.
    Oldest,
    /// What came last, as its memory may still be in the caches.
    Latest,
}

/// Work by generation, and work that was set aside for want of memory.
///
/// It is bounded by what it holds: SPOTs and children in flight, which the budget limits. It never
/// makes anyone wait.
pub(crate) struct PriorityQueue<T> {
    order: Order,
    within: Within,
    by_generation: Vec<VecDeque<(u64, T)>>,
    /// No generation at or above this has work.
    end: usize,
    /// By root, oldest first; within a root in the order in which it was set aside.
    set_aside: BTreeMap<u64, VecDeque<T>>,
}

impl<T> PriorityQueue<T> {
    /// Of equal generation, `within` says what goes first; where generations do not count, what was
    /// first.
    pub(crate) fn new(order: Order, within: Within) -> Self {
        Self {
            order,
            within: match order {
                Order::HighestGeneration => within,
                Order::FirstCome => Within::Oldest,
            },
            by_generation: Vec::new(),
            end: 0,
            set_aside: BTreeMap::new(),
        }
    }

    /// Adds work that belongs to `root`.
    pub(crate) fn push(&mut self, generation: u32, root: u64, item: T) {
        let level = match self.order {
            Order::HighestGeneration => generation as usize,
            Order::FirstCome => 0,
        };
        if level >= self.by_generation.len() {
            self.by_generation.resize_with(level + 1, VecDeque::new);
        }
        self.by_generation[level].push_back((root, item));
        self.end = self.end.max(level + 1);
    }

    /// How urgent the first work is: above its generation, and above all generations if it was set
    /// aside before. 0 if there is none.
    pub(crate) fn urgency(&mut self) -> usize {
        if !self.set_aside.is_empty() {
            return usize::MAX;
        }
        while self.end > 0 && self.by_generation[self.end - 1].is_empty() {
            self.end -= 1;
        }
        self.end
    }

    /// Takes the first work.
    pub(crate) fn pop(&mut self) -> Option<T> {
        match self.urgency() {
            0 => None,
            usize::MAX => {
                let root = self.oldest_set_aside()?;
                self.pop_set_aside(root)
            }
            end => {
                let equals = &mut self.by_generation[end - 1];
                let first = match self.within {
                    Within::Oldest => equals.pop_front(),
                    Within::Latest => equals.pop_back(),
                };
                first.map(|(_, item)| item)
            }
        }
    }

    /// Takes the first work of the given roots and sets aside what comes before it.
    pub(crate) fn pop_of(&mut self, roots: &[u64]) -> Option<T> {
        for &root in roots {
            if let Some(item) = self.pop_set_aside(root) {
                return Some(item);
            }
        }
        while self.end > 0 {
            while let Some((root, item)) = self.by_generation[self.end - 1].pop_front() {
                if roots.contains(&root) {
                    return Some(item);
                }
                self.set_aside.entry(root).or_default().push_back(item);
            }
            self.end -= 1;
        }
        None
    }

    /// The oldest root whose work was set aside.
    pub(crate) fn oldest_set_aside(&self) -> Option<u64> {
        self.set_aside.keys().next().copied()
    }

    fn pop_set_aside(&mut self, root: u64) -> Option<T> {
        let items = self.set_aside.get_mut(&root)?;
        let item = items.pop_front();
        if items.is_empty() {
            self.set_aside.remove(&root);
        }
        item
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drain(queue: &mut PriorityQueue<&'static str>) -> Vec<&'static str> {
        std::iter::from_fn(|| queue.pop()).collect()
    }

    fn filled(order: Order, within: Within) -> PriorityQueue<&'static str> {
        let mut queue = PriorityQueue::new(order, within);
        queue.push(1, 0, "a");
        queue.push(3, 1, "b");
        queue.push(3, 0, "c");
        queue.push(0, 2, "d");
        queue
    }

    #[test]
    fn highest_generation_goes_first() {
        for (within, expected) in [
            (Within::Oldest, ["b", "c", "a", "d"]),
            (Within::Latest, ["c", "b", "a", "d"]),
        ] {
            let mut queue = filled(Order::HighestGeneration, within);
            assert_eq!(queue.urgency(), 4);
            assert_eq!(drain(&mut queue), expected);
            assert_eq!(queue.urgency(), 0);
        }
    }

    #[test]
    fn first_come_first_served() {
        for within in [Within::Oldest, Within::Latest] {
            let drained = drain(&mut filled(Order::FirstCome, within));
            assert_eq!(drained, ["a", "b", "c", "d"]);
        }
    }

    #[test]
    fn what_is_set_aside_comes_back_by_root() {
        let mut queue = filled(Order::HighestGeneration, Within::Oldest);
        assert_eq!(queue.pop_of(&[2]), Some("d"));
        assert_eq!(queue.pop_of(&[2]), None);
        assert_eq!(queue.oldest_set_aside(), Some(0));
        queue.push(9, 3, "e");
        assert_eq!(queue.pop_of(&[1]), Some("b"));
        assert_eq!(drain(&mut queue), ["c", "a", "e"]);
    }
}
