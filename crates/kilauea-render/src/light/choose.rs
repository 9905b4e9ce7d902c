//! Choosing one of all lights: first between those that are in the scene and those around it, then
//! among either.

use kilauea_gather::Turn;

use super::walk::{LightChooser, LightWalk, NotedWalk, takes_second};
use super::{Lights, Receiver};

/// Share of choices that is even, as importance does not know what is occluded.
const EVEN_SHARE: f32 = 0.25;

/// A light that was chosen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PickedLight {
    /// Number of the light: finite ones, then those at infinity.
    pub(crate) light: u32,
    pub(crate) probability: f32,
}

impl Lights {
    /// Chooses a light; `u` is in [0, 1).
    #[inline]
    pub(crate) fn choose(
        &self,
        receiver: Receiver,
        mut u: f32,
        chooser: impl LightChooser,
    ) -> Option<PickedLight> {
        let mut walk = chooser.walk(receiver);
        u = walk.begin(u);
        let is_infinite = !self.infinite.is_empty()
            && walk.turn(
                self.tree.n_forks(),
                self.finite_probability(receiver),
                |first| takes_second(&mut u, first),
            );
        let light = if is_infinite {
            let last = self.infinite.len() - 1;
            let idx = self.infinite_forks(receiver).position(|(fork, first)| {
                !walk.turn(fork, first, |first| takes_second(&mut u, first))
            });
            self.infinite_number(idx.unwrap_or(last))
        } else {
            self.tree.sample(receiver.p, receiver.n, u, &mut walk)?
        };
        Some(PickedLight {
            light,
            probability: walk.probability(),
        })
    }

    /// The turns of the way to a light, where it is chosen by importance.
    pub(crate) fn turns_to(&self, light: u32, receiver: Receiver) -> Vec<Turn> {
        let mut walk = NotedWalk(Vec::new());
        self.follow(light, receiver, &mut walk);
        walk.0
    }

    /// Probability with which [`Self::choose`] finds a light.
    pub(crate) fn probability(
        &self,
        light: u32,
        receiver: Receiver,
        chooser: impl LightChooser,
    ) -> f32 {
        let mut walk = chooser.walk(receiver);
        if self.follow(light, receiver, &mut walk) {
            walk.probability()
        } else {
            0.0
        }
    }

    /// Goes the way to a light; whether there is one.
    #[inline]
    fn follow(&self, light: u32, receiver: Receiver, walk: &mut impl LightWalk) -> bool {
        let n_finite = self.area.len() + self.mesh.len();
        let idx = (light as usize).checked_sub(n_finite);
        let idx = idx.filter(|&idx| idx < self.infinite.len());
        if !self.infinite.is_empty() {
            let finite = self.finite_probability(receiver);
            walk.turn(self.tree.n_forks(), finite, |_| idx.is_some());
        }
        let Some(idx) = idx else {
            return self.tree.follow(receiver.p, receiver.n, light, walk);
        };
        debug_assert!(idx < self.infinite.len(), "a light of another scene");
        for (other, (fork, first)) in self.infinite_forks(receiver).enumerate().take(idx + 1) {
            walk.turn(fork, first, |_| other != idx);
        }
        true
    }

    /// Probability of choosing the tree over the infinite lights.
    #[inline]
    pub(super) fn finite_probability(&self, receiver: Receiver) -> f32 {
        if self.infinite.is_empty() {
            return 1.0;
        }
        if self.tree.is_empty() {
            return 0.0;
        }
        let finite = self.tree.importance(receiver.p, receiver.n);
        if finite <= 0.0 {
            return 0.0;
        }
        let infinite: f32 = self.infinite.iter().map(|l| l.importance(receiver)).sum();
        let share = finite / (finite + infinite);
        partly_even(1.0 / (self.even_weight + 1.0), share)
    }

    /// The forks where one light at infinity is chosen over those after it.
    #[inline]
    pub(super) fn infinite_forks(&self, receiver: Receiver) -> impl Iterator<Item = (u32, f32)> {
        let first_fork = self.tree.n_forks() + 1;
        let mut left = 1.0;
        (0..self.infinite.len().saturating_sub(1)).map(move |idx| {
            let probability = self.infinite_probability(receiver, idx);
            let first = (probability / left).min(1.0);
            left -= probability;
            (first_fork + idx as u32, first)
        })
    }

    fn infinite_probability(&self, receiver: Receiver, idx: usize) -> f32 {
        let n = self.infinite.len();
        if n == 1 {
            return 1.0;
        }
        let sum: f32 = self.infinite.iter().map(|l| l.importance(receiver)).sum();
        let share = if sum > 0.0 {
            self.infinite[idx].importance(receiver) / sum
        } else {
            1.0 / n as f32
        };
        partly_even(self.infinite[idx].even_weight() / self.even_weight, share)
    }
}

fn partly_even(even: f32, by_importance: f32) -> f32 {
    EVEN_SHARE * even + (1.0 - EVEN_SHARE) * by_importance
}
