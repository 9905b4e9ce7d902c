//! The photons of a frame's passes, divided among the members of a set.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use kilauea_photon::PhotonMap;

use crate::integrator::{Answer, ArrivingPhoton, PhotonQuestion};

/// Passes whose photons are kept: those of the one before, too, for members that are late with it.
pub(crate) const MOST_PASSES: usize = 2;

/// The parts of maps that members in this process have, pass by pass.
#[derive(Default)]
pub(crate) struct PhotonParts {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    kept: VecDeque<PassParts>,
    /// The number after that of the last pass that was here, or that was over before.
    next: u32,
    ahead: Ahead,
    /// The largest map of each member, by number; nothing before the first pass.
    largest: Vec<MemberPhotons>,
}

/// Photons that a member holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct MemberPhotons {
    pub(crate) photons: u64,
    /// Of their map.
    pub(crate) bytes: u64,
}

/// What is to be expected of passes after the last one.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
enum Ahead {
    /// They come.
    #[default]
    More,
    /// There are none, as the time is up.
    Nothing,
    /// This process does nothing more, and another may take its place.
    Closed,
}

/// The maps of one pass.
#[derive(Clone)]
pub(crate) struct PassParts {
    pub(crate) pass: u32,
    /// Engine space.
    pub(crate) radius: f32,
    /// By member; empty for those that are elsewhere.
    pub(crate) maps: Arc<[Option<PhotonMap>]>,
}

/// What there is to answer a question with.
pub(crate) enum Found {
    Photons(Answer),
    /// Not yet.
    Later,
    /// Nobody answers here any more.
    Closed,
}

impl PhotonParts {
    /// Takes the maps of the next pass.
    pub(crate) fn add(&self, parts: PassParts) {
        let mut state = self.lock();
        state
            .largest
            .resize_with(parts.maps.len(), MemberPhotons::default);
        for (largest, map) in state.largest.iter_mut().zip(&*parts.maps) {
            let map = map.as_ref();
            largest.photons = largest.photons.max(map.map_or(0, |map| map.len() as u64));
            largest.bytes = largest.bytes.max(map.map_or(0, |map| map.bytes() as u64));
        }
        state.next = parts.pass + 1;
        state.kept.push_back(parts);
        if state.kept.len() > MOST_PASSES {
            state.kept.pop_front();
        }
        drop(state);
        self.changed.notify_all();
    }

    /// All samples of a pass are there without its photons: who asks for them is late.
    pub(crate) fn skip(&self, pass: u32) {
        let mut state = self.lock();
        state.next = pass + 1;
        drop(state);
        self.changed.notify_all();
    }

    /// No passes come any more, as the time is up: who asks for their photons gets none.
    pub(crate) fn end(&self) {
        self.set_ahead(Ahead::Nothing);
    }

    /// Nothing comes any more that is not here, but maybe from a successor.
    pub(crate) fn close(&self) {
        self.set_ahead(Ahead::Closed);
    }

    fn set_ahead(&self, ahead: Ahead) {
        let mut state = self.lock();
        if state.ahead == Ahead::More {
            state.ahead = ahead;
        }
        drop(state);
        self.changed.notify_all();
    }

    /// The photons that a member in this process has of those that a look-up finds.
    pub(crate) fn look_up(&self, member: usize, question: &PhotonQuestion) -> Found {
        let state = self.lock();
        let parts = state.kept.iter().find(|parts| parts.pass == question.pass);
        let Some(parts) = parts.cloned() else {
            return match state.ahead {
                _ if question.pass < state.next => Found::Photons(Answer::Photons(None)),
                Ahead::Nothing => Found::Photons(Answer::Photons(None)),
                Ahead::More => Found::Later,
                Ahead::Closed => Found::Closed,
            };
        };
        drop(state);
        let mut photons = Vec::new();
        if let Some(Some(map)) = parts.maps.get(member) {
            let mut n_told = question.n_told;
            ArrivingPhoton::for_each(map, &question.at, parts.radius, |&photon| {
                if n_told > 0 {
                    n_told -= 1;
                } else {
                    photons.push(photon);
                }
            });
        }
        Found::Photons(Answer::Photons(Some(photons)))
    }

    /// The largest map that a member in this process has had.
    pub(crate) fn largest(&self, member: usize) -> MemberPhotons {
        self.lock().largest.get(member).copied().unwrap_or_default()
    }

    /// Waits until the photons of a pass are here, or never will be.
    pub(crate) fn wait_for(&self, pass: u32) {
        let is_to_come = |state: &mut State| pass >= state.next && state.ahead == Ahead::More;
        let waited = self.changed.wait_while(self.lock(), is_to_come);
        drop(waited.unwrap_or_else(PoisonError::into_inner));
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_math::Vec3;
    use kilauea_photon::SurfaceQuery;
    use std::thread::scope;

    fn pass(pass: u32) -> PassParts {
        PassParts {
            pass,
            radius: 1.0,
            maps: Arc::new([None, Some(PhotonMap::build(&[]))]),
        }
    }

    fn ask(parts: &PhotonParts, pass: u32) -> Found {
        let at = SurfaceQuery {
            p: Vec3::ZERO,
            n: Vec3::Z,
        };
        let n_told = 0;
        parts.look_up(1, &PhotonQuestion { pass, at, n_told })
    }

    fn has(parts: &PhotonParts, pass: u32) -> bool {
        matches!(ask(parts, pass), Found::Photons(Answer::Photons(Some(_))))
    }

    fn is_gone(parts: &PhotonParts, pass: u32) -> bool {
        matches!(ask(parts, pass), Found::Photons(Answer::Photons(None)))
    }

    #[test]
    fn the_last_two_passes_are_here_and_older_ones_gone() {
        let parts = PhotonParts::default();
        assert!(matches!(ask(&parts, 0), Found::Later));
        // A successor has not been in all passes.
        for (number, older) in [(0, None), (3, Some(0)), (4, Some(3))] {
            parts.add(pass(number));
            assert!(has(&parts, number) && older.is_none_or(|older| has(&parts, older)));
            assert!(matches!(ask(&parts, number + 1), Found::Later));
        }
        assert!(is_gone(&parts, 0) && is_gone(&parts, 2));
        parts.skip(5);
        assert!(is_gone(&parts, 5) && has(&parts, 4), "the others went on");
    }

    #[test]
    fn nobody_waits_for_passes_that_do_not_come() {
        let late = PhotonParts::default();
        late.add(pass(0));
        let closed = PhotonParts::default();
        scope(|threads| {
            threads.spawn(|| late.wait_for(1));
            threads.spawn(|| closed.wait_for(0));
            late.end();
            closed.close();
        });
        assert!(has(&late, 0) && is_gone(&late, 1));
        assert!(matches!(ask(&closed, 0), Found::Closed));
        late.close();
        assert!(is_gone(&late, 1), "what was said stays");
    }

    #[test]
    fn who_waits_goes_on_when_the_photons_are_here() {
        let parts = PhotonParts::default();
        scope(|threads| {
            let waits = threads.spawn(|| parts.wait_for(0));
            parts.add(pass(0));
            waits.join().expect("no panic");
        });
        assert!(has(&parts, 0));
    }
}
