//! Paths that workers follow together: lends them out, and sends what they left to all who need it.

use std::collections::BTreeSet;
use std::ops::Range;
use std::time::Duration;

use kilauea_render::{PathKind, PathPass};

use super::Console;
use crate::error::ClusterError;
use crate::protocol::{Frame, Message, PathsLeft, PathsLent};

/// Ranges for each worker, so that none waits long for the last one.
const RANGES_PER_WORKER: u32 = 4;
/// All of them have to find room in the outbox of a worker that comes late.
const MOST_RANGES: u32 = 64;
/// Passes of which it is kept what paths left, for workers that come late. What is asked for after that
/// is followed again.
const MOST_PASSES: usize = 8;

/// All passes over paths that workers are in.
#[derive(Default)]
pub(super) struct SharedPasses {
    passes: Vec<SharedPass>,
    /// Of all passes so far.
    kinds: BTreeSet<PathKind>,
}

/// A pass over paths.
struct SharedPass {
    pass: PathPass,
    ranges: Vec<PathRange>,
    /// Lives of workers that are in it.
    epochs: Vec<u32>,
}

/// Some of its paths.
struct PathRange {
    paths: Range<u32>,
    state: RangeState,
}

enum RangeState {
    Free,
    Lent {
        epoch: u32,
        since: Duration,
    },
    /// What they left, as it came.
    Done(Frame),
}

/// What is to be sent to a worker, by its epoch.
pub(super) type Dispatch = (u32, Frame);

impl SharedPasses {
    /// A worker is in a pass: it gets what is known already. `n_workers` is how many may come.
    pub(super) fn want(&mut self, epoch: u32, pass: PathPass, n_workers: u32) -> Vec<Dispatch> {
        if !self.passes.iter().any(|of| of.pass == pass) {
            self.forget();
            self.kinds.insert(pass.kind);
            self.passes.push(SharedPass::new(pass, n_workers));
        }
        let mut known = Vec::new();
        for of in self.passes.iter_mut().filter(|of| of.pass == pass) {
            if !of.epochs.contains(&epoch) {
                of.epochs.push(epoch);
            }
            let done = of.ranges.iter().filter_map(PathRange::done);
            known.extend(done.map(|frame| (epoch, frame.clone())));
        }
        known
    }

    /// Forgets the oldest pass of which all is known: who is in it has been sent all of it.
    fn forget(&mut self) {
        let is_known = |of: &SharedPass| of.ranges.iter().all(|range| range.done().is_some());
        if self.passes.len() >= MOST_PASSES
            && let Some(at) = self.passes.iter().position(is_known)
        {
            self.passes.remove(at);
        }
    }

    /// Lends paths to all who are in a pass and hold none; those that are late once more.
    pub(super) fn lend(&mut self, now: Duration, patience: Duration) -> Vec<Dispatch> {
        let mut lent = Vec::new();
        for of in &mut self.passes {
            for &epoch in &of.epochs {
                let holds = |range: &PathRange| range.is_held_by(epoch);
                if of.ranges.iter().any(holds) {
                    continue;
                }
                let mut ranges = of.ranges.iter_mut();
                let Some(range) = ranges.find(|range| range.is_to_lend(now, patience)) else {
                    continue;
                };
                range.state = RangeState::Lent { epoch, since: now };
                let paths = range.paths.clone();
                let pass = of.pass;
                lent.push((epoch, PathsLent { pass, paths }.frame(epoch, &[])));
            }
        }
        lent
    }

    /// Takes what paths left, and sends it to all others who are in the pass. Of two who followed the
    /// same paths the first counts.
    pub(super) fn settle(&mut self, from: u32, said: &PathsLeft, frame: &Frame) -> Vec<Dispatch> {
        let mut passes = self.passes.iter_mut();
        let Some(of) = passes.find(|of| of.pass == said.pass) else {
            return Vec::new();
        };
        let mut ranges = of.ranges.iter_mut();
        let range = ranges.find(|range| range.paths == said.paths);
        let Some(range) = range.filter(|range| range.done().is_none()) else {
            return Vec::new();
        };
        range.state = RangeState::Done(frame.clone());
        let others = of.epochs.iter().filter(|&&epoch| epoch != from);
        others.map(|&epoch| (epoch, frame.clone())).collect()
    }

    /// What was followed together.
    pub(super) fn names(&self) -> impl Iterator<Item = &'static str> {
        self.kinds.iter().map(|kind| kind.name())
    }

    /// Takes back what a life held which has ended.
    pub(super) fn bury(&mut self, epoch: u32) {
        for of in &mut self.passes {
            of.epochs.retain(|&other| other != epoch);
            let held = of.ranges.iter_mut().filter(|r| r.is_held_by(epoch));
            held.for_each(|range| range.state = RangeState::Free);
        }
    }
}

impl SharedPass {
    fn new(pass: PathPass, n_workers: u32) -> Self {
        let n_ranges = n_workers.max(1).saturating_mul(RANGES_PER_WORKER);
        let n_ranges = n_ranges.min(MOST_RANGES);
        let grain = pass.kind.grain();
        let step = pass.n_paths.div_ceil(n_ranges).next_multiple_of(grain);
        let starts = (0..pass.n_paths).step_by(step.max(grain) as usize);
        let range = |start: u32| PathRange {
            paths: start..start.saturating_add(step).min(pass.n_paths),
            state: RangeState::Free,
        };
        Self {
            pass,
            ranges: starts.map(range).collect(),
            epochs: Vec::new(),
        }
    }
}

impl PathRange {
    fn done(&self) -> Option<&Frame> {
        match &self.state {
            RangeState::Done(frame) => Some(frame),
            RangeState::Free | RangeState::Lent { .. } => None,
        }
    }

    fn is_held_by(&self, holder: u32) -> bool {
        matches!(self.state, RangeState::Lent { epoch, .. } if epoch == holder)
    }

    fn is_to_lend(&self, now: Duration, patience: Duration) -> bool {
        match self.state {
            RangeState::Free => true,
            RangeState::Lent { since, .. } => now.saturating_sub(since) > patience,
            RangeState::Done(_) => false,
        }
    }
}

impl Console {
    /// A worker is in a pass over paths.
    pub(super) fn want_paths(&mut self, epoch: u32, pass: PathPass) -> Result<(), ClusterError> {
        let known = self.paths.want(epoch, pass, self.options.n_workers);
        self.dispatch(known)
    }

    /// Takes what paths left.
    pub(super) fn take_paths(
        &mut self,
        epoch: u32,
        said: &PathsLeft,
        frame: &Frame,
    ) -> Result<(), ClusterError> {
        let to_others = self.paths.settle(epoch, said, frame);
        self.dispatch(to_others)
    }

    /// Lends paths to all who wait for some.
    pub(super) fn lend_paths(&mut self) -> Result<(), ClusterError> {
        let lent = self.paths.lend(self.now(), self.options.patience);
        self.dispatch(lent)
    }

    fn dispatch(&mut self, frames: Vec<Dispatch>) -> Result<(), ClusterError> {
        for (epoch, mut frame) in frames {
            frame.epoch = epoch;
            let peer = self.peers.get(&epoch);
            if peer.is_some_and(|peer| !peer.send(frame)) {
                self.replace(epoch, "it takes no more paths")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::FrameKind;

    const PATIENCE: Duration = Duration::from_secs(10);
    const START: Duration = Duration::ZERO;

    fn pass(seed: u32) -> PathPass {
        PathPass {
            kind: PathKind::Photons,
            seed,
            n_paths: 20_000,
        }
    }

    /// What comes of a dispatch, as its worker would answer it.
    fn answer(dispatch: &Dispatch) -> Option<(u32, PathsLeft, Frame)> {
        let (epoch, frame) = dispatch;
        let (PathsLent { pass, paths }, _) = PathsLent::read(frame).ok()?;
        let left = PathsLeft { pass, paths };
        let frame = left.frame(*epoch, &[7]);
        Some((*epoch, left, frame))
    }

    /// The paths that a worker knows of, in order.
    fn known(frames: &[Dispatch], of: u32) -> Vec<Range<u32>> {
        let mine = frames.iter().filter(|(epoch, _)| *epoch == of);
        let left = mine.filter(|(_, frame)| frame.kind == FrameKind::PathsLeft);
        let mut paths: Vec<_> = left
            .map(|(_, frame)| PathsLeft::read(frame).expect("it is one").0.paths)
            .collect();
        paths.sort_by_key(|paths| paths.start);
        paths
    }

    fn covers(paths: &[Range<u32>], n: u32) -> bool {
        let starts = paths.iter().map(|paths| paths.start);
        let ends = std::iter::once(0).chain(paths.iter().map(|paths| paths.end));
        starts.eq(ends.clone().take(paths.len())) && ends.last() == Some(n)
    }

    fn follow_next(passes: &mut SharedPasses) -> Option<(u32, PathsLeft, Frame)> {
        answer(passes.lend(START, PATIENCE).first()?)
    }

    #[test]
    fn every_path_is_followed_once_and_known_to_all() {
        let mut passes = SharedPasses::default();
        assert!(passes.want(1, pass(0), 2).is_empty());
        assert!(passes.want(2, pass(0), 2).is_empty());
        let mut sent = Vec::new();
        let mut followed = Vec::new();
        loop {
            let lent = passes.lend(START, PATIENCE);
            if lent.is_empty() {
                break;
            }
            for (epoch, left, frame) in lent.iter().filter_map(answer) {
                followed.push((epoch, frame.clone()));
                sent.extend(passes.settle(epoch, &left, &frame));
            }
        }
        for epoch in [1, 2] {
            let own = followed.iter().filter(|(by, _)| *by == epoch);
            let all: Vec<Dispatch> = own.chain(&sent).cloned().collect();
            assert!(covers(&known(&all, epoch), 20_000), "worker {epoch}");
        }
        assert_eq!(passes.names().collect::<Vec<_>>(), ["photons"]);
        // One that comes late follows nothing.
        let late = passes.want(3, pass(0), 2);
        assert!(covers(&known(&late, 3), 20_000));
        assert!(passes.lend(START, PATIENCE).is_empty());
    }

    #[test]
    fn what_the_dead_and_the_late_held_is_lent_again() {
        let mut passes = SharedPasses::default();
        let one = PathPass {
            n_paths: 100,
            ..pass(0)
        };
        passes.want(1, one, 2);
        assert_eq!(passes.lend(START, PATIENCE).len(), 1);
        passes.want(2, one, 2);
        assert!(passes.lend(START, PATIENCE).is_empty(), "it is not late");
        passes.bury(1);
        let again = passes.lend(START, PATIENCE);
        assert_eq!(again[0].0, 2);
        passes.want(3, one, 2);
        let twice = passes.lend(PATIENCE * 2, PATIENCE);
        assert_eq!(twice[0].0, 3);
        for dispatch in [&again[0], &twice[0]] {
            let (epoch, left, frame) = answer(dispatch).expect("paths were lent");
            let n_sent = passes.settle(epoch, &left, &frame).len();
            assert_eq!(n_sent, usize::from(epoch == 2), "the first counts");
        }
    }

    #[test]
    fn passes_that_are_long_over_are_forgotten() {
        let mut passes = SharedPasses::default();
        for seed in 0..10 {
            passes.want(1, pass(seed), 2);
            assert!(passes.passes.len() <= MOST_PASSES);
            while let Some((epoch, left, frame)) = follow_next(&mut passes) {
                passes.settle(epoch, &left, &frame);
            }
        }
        assert!(!passes.want(2, pass(9), 2).is_empty(), "it is known");
        assert!(passes.want(2, pass(0), 2).is_empty(), "it begins again");
    }
}
