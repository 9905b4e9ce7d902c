//! A frame over many sets, which take tiles first come, first served, while machines fail.

use crate::events::Events;
use crate::random::Random;

/// Sets and a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FarmModel {
    /// Rays that each set gets answered in a second.
    pub set_rays_per_sec: Vec<f64>,
    /// Machines in each set.
    pub n_members: usize,
    /// Tiles of the frame, in all their passes.
    pub n_tiles: u64,
    /// Rays of a tile, on average.
    pub tile_rays: f64,
    /// Tiles differ by a factor of up to this, evenly.
    pub tile_spread: f64,
    /// Mean seconds until a machine fails; infinite if none ever does.
    pub mean_secs_to_failure: f64,
    /// Seconds until a failure is noticed and what was lost is placed again, during which the whole
    /// set stands still.
    pub recovery_secs: f64,
}

/// What became of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameOutcome {
    /// Seconds from the first tile to the last.
    pub seconds: f64,
    /// Of what all sets could do in that time, the part that is in the frame.
    pub efficiency: f64,
    /// Tiles that were begun again, as a machine that worked on them failed.
    pub n_lost: u64,
    /// Machines that failed.
    pub n_failures: u64,
    /// Tiles done.
    pub n_done: u64,
}

enum Event {
    /// A set has done a tile, unless it failed since.
    Done {
        set: usize,
        round: u64,
    },
    Fails {
        set: usize,
    },
    Recovers {
        set: usize,
    },
}

/// A set in a frame.
#[derive(Clone, Copy, Default)]
struct SetState {
    /// How often it failed.
    round: u64,
    is_down: bool,
    /// Rays of the tile that it works on; none if it has none.
    tile: Option<f64>,
}

impl FarmModel {
    /// Renders one frame; `seed` decides about tiles and failures.
    pub fn frame(&self, seed: u64) -> FrameOutcome {
        let mut random = Random(seed);
        let mut events = Events::new();
        let mut sets = vec![SetState::default(); self.set_rays_per_sec.len()];
        let mut waiting: Vec<f64> = (0..self.n_tiles)
            .map(|_| {
                let spread = self.tile_spread.max(1.0);
                // Evenly between 1/spread and spread times, the mean kept.
                let mean = 0.5 * (1.0 / spread + spread);
                self.tile_rays * (1.0 / spread + random.unit() * (spread - 1.0 / spread)) / mean
            })
            .collect();
        let rays: f64 = waiting.iter().sum();
        let mut outcome = FrameOutcome {
            seconds: 0.0,
            efficiency: 0.0,
            n_lost: 0,
            n_failures: 0,
            n_done: 0,
        };
        let mean_to_failure = self.mean_secs_to_failure / self.n_members.max(1) as f64;
        for set in 0..sets.len() {
            if mean_to_failure.is_finite() {
                events.at(random.exponential(mean_to_failure), Event::Fails { set });
            }
            self.give(set, &mut sets, &mut waiting, &mut events);
        }
        while outcome.n_done < self.n_tiles {
            let Some(event) = events.next() else { break };
            match event {
                Event::Done { set, round } if sets[set].round == round => {
                    sets[set].tile = None;
                    outcome.n_done += 1;
                    self.give(set, &mut sets, &mut waiting, &mut events);
                }
                Event::Done { .. } => {}
                Event::Fails { set } => {
                    outcome.n_failures += 1;
                    let state = &mut sets[set];
                    state.round += 1;
                    state.is_down = true;
                    if let Some(tile) = state.tile.take() {
                        outcome.n_lost += 1;
                        waiting.push(tile);
                        // Whoever has nothing to do takes it.
                        if let Some(idle) = (0..sets.len()).find(|&s| is_idle(&sets[s])) {
                            self.give(idle, &mut sets, &mut waiting, &mut events);
                        }
                    }
                    events.at(events.now + self.recovery_secs, Event::Recovers { set });
                }
                Event::Recovers { set } => {
                    sets[set].is_down = false;
                    let next = events.now + random.exponential(mean_to_failure);
                    events.at(next, Event::Fails { set });
                    self.give(set, &mut sets, &mut waiting, &mut events);
                }
            }
        }
        let all_sets: f64 = self.set_rays_per_sec.iter().sum();
        outcome.seconds = events.now;
        outcome.efficiency = rays / (all_sets * outcome.seconds).max(f64::MIN_POSITIVE);
        outcome
    }

    /// Gives a set a tile, if there is one and it can take it.
    fn give(
        &self,
        set: usize,
        sets: &mut [SetState],
        waiting: &mut Vec<f64>,
        events: &mut Events<Event>,
    ) {
        let state = &mut sets[set];
        if !is_idle(state) {
            return;
        }
        let Some(tile) = waiting.pop() else { return };
        state.tile = Some(tile);
        let done = events.now + tile / self.set_rays_per_sec[set];
        let round = state.round;
        events.at(done, Event::Done { set, round });
    }
}

fn is_idle(state: &SetState) -> bool {
    !state.is_down && state.tile.is_none()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn farm(n_sets: usize) -> FarmModel {
        FarmModel {
            set_rays_per_sec: vec![1e6; n_sets],
            n_members: 4,
            n_tiles: 4096,
            tile_rays: 1e5,
            tile_spread: 1.0,
            mean_secs_to_failure: f64::INFINITY,
            recovery_secs: 5.0,
        }
    }

    #[test]
    fn sets_share_the_tiles_out() {
        for n_sets in [1, 2, 64] {
            let outcome = farm(n_sets).frame(1);
            let expected = 4096.0 * 0.1 / n_sets as f64;
            assert!(
                (outcome.seconds / expected - 1.0).abs() < 1e-9,
                "{outcome:?}"
            );
            assert!((outcome.efficiency - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_slow_set_takes_fewer_tiles() {
        let mut farm = farm(4);
        farm.set_rays_per_sec[2] = 1e5;
        let outcome = farm.frame(1);
        // 3.1 sets' worth of work, and the slow set's last tile at most.
        let expected = 4096.0 * 0.1 / 3.1;
        assert!(outcome.seconds >= expected && outcome.seconds < expected + 1.0);
    }

    #[test]
    fn failures_cost_time_and_no_tiles() {
        let mut farm = farm(8);
        farm.tile_spread = 2.0;
        let undisturbed = farm.frame(5);
        farm.mean_secs_to_failure = 200.0;
        let disturbed = farm.frame(5);
        assert!(disturbed.n_failures > 0 && disturbed.n_lost > 0);
        assert_eq!(disturbed.n_done, farm.n_tiles);
        assert!(disturbed.seconds > undisturbed.seconds);
        // Each set is down for 5 s of every 50 + 5.
        let expected = undisturbed.seconds * (1.0 + 5.0 / 50.0);
        assert!(
            (disturbed.seconds / expected - 1.0).abs() < 0.1,
            "{disturbed:?}"
        );
    }
}
