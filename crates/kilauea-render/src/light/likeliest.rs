//! Which lights a place chooses most often.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::choose::PickedLight;
use super::tree::TreeStep;
use super::walk::{LightChooser, LightWalk};
use super::{Lights, Receiver};

/// A part of a way to lights.
struct Way<W> {
    at: At,
    walk: W,
    /// Of its turns: no light behind it is chosen more often.
    probability: f32,
}

#[derive(Clone, Copy)]
enum At {
    /// Between lights in the scene and those around it.
    Start,
    /// At a node of the tree.
    Node(usize),
    /// Between one light at infinity and those after it.
    Infinite(usize),
    Light(u32),
}

impl Lights {
    /// The lights that are chosen most often at a place, the likeliest first, until they make up `share`
    /// of all choices or there are no more.
    pub(crate) fn likeliest<C: LightChooser<Walk: Copy>>(
        &self,
        receiver: Receiver,
        chooser: C,
        share: f32,
    ) -> Vec<PickedLight> {
        let mut found = Vec::new();
        let mut made_up = 0.0;
        let mut ways = BinaryHeap::from([Way {
            at: At::Start,
            walk: chooser.walk(receiver),
            probability: 1.0,
        }]);
        while made_up < share
            && let Some(way) = ways.pop()
        {
            if let At::Light(light) = way.at {
                let probability = way.probability;
                made_up += probability;
                found.push(PickedLight { light, probability });
            } else {
                let possible = self.next(&way, receiver).into_iter().flatten();
                ways.extend(possible.filter(|way| way.probability > 0.0));
            }
        }
        found
    }

    /// The one or two ways on.
    fn next<W: LightWalk + Copy>(&self, way: &Way<W>, receiver: Receiver) -> [Option<Way<W>>; 2] {
        match way.at {
            At::Start if self.infinite.is_empty() => way.to(At::Node(0)),
            At::Start => {
                let first = self.finite_probability(receiver);
                way.part(self.tree.n_forks(), first, [At::Node(0), At::Infinite(0)])
            }
            At::Infinite(idx) => {
                let here = At::Light(self.infinite_number(idx));
                match self.infinite_forks(receiver).nth(idx) {
                    Some((fork, first)) => way.part(fork, first, [here, At::Infinite(idx + 1)]),
                    None => way.to(here),
                }
            }
            At::Node(idx) => match self.tree.step(idx, receiver.p, receiver.n) {
                Some(TreeStep::Light(light)) => way.to(At::Light(light)),
                Some(TreeStep::Fork { first, children }) => {
                    way.part(idx as u32, first, children.map(At::Node))
                }
                None => [None, None],
            },
            At::Light(_) => [None, None],
        }
    }
}

impl<W: LightWalk + Copy> Way<W> {
    fn to(&self, at: At) -> [Option<Self>; 2] {
        let Self {
            walk, probability, ..
        } = *self;
        let way = Self {
            at,
            walk,
            probability,
        };
        [Some(way), None]
    }

    fn part(&self, fork: u32, first: f32, ats: [At; 2]) -> [Option<Self>; 2] {
        [(ats[0], false), (ats[1], true)].map(|(at, is_second)| {
            let mut walk = self.walk;
            walk.turn(fork, first, |_| is_second);
            Some(Self {
                at,
                walk,
                probability: walk.probability(),
            })
        })
    }
}

impl<W> Ord for Way<W> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.probability.total_cmp(&other.probability)
    }
}

impl<W> PartialOrd for Way<W> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<W> PartialEq for Way<W> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl<W> Eq for Way<W> {}
