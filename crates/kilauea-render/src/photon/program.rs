//! The program that the dataflow engine runs to trace photons.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use kilauea_photon::Photon;
use kilauea_spot::{Context, Job, Pool, Program, Runtime};

use super::counts::PhotonCounts;
use super::tracer::PhotonTracer;
use crate::integrator::{Answer, Media, Question};

/// A SPOT follows some photons, one after the other.
pub(super) struct PhotonProgram<'a, const CUTOUTS: bool, M> {
    pub(super) tracer: PhotonTracer<'a, CUTOUTS, M>,
}

/// What some paths left.
#[derive(Default)]
pub(super) struct Traced {
    pub(super) photons: Vec<Photon>,
    pub(super) counts: PhotonCounts,
}

/// All paths of a request, cut into roots.
pub(super) struct PhotonJob {
    n_emitted: u32,
    per_root: u32,
    /// By root, as they end.
    traced: Mutex<Vec<Traced>>,
}

impl<const CUTOUTS: bool, M: Media> Program for PhotonProgram<'_, CUTOUTS, M> {
    type Work = Range<u32>;
    type Output = Traced;
    type Question = Question;
    type Answer = Answer;

    fn starter<'a, R: Runtime<'a, Self>>(
        &'a self,
        runtime: &R,
    ) -> impl Fn(Range<u32>, R::Context) -> R::Started {
        let paths = runtime.pool();
        move |work, cx| paths.start("photons", self.trace_all(work, cx))
    }
}

impl<const CUTOUTS: bool, M: Media> PhotonProgram<'_, CUTOUTS, M> {
    async fn trace_all<C: Context<Self>>(&self, paths: Range<u32>, cx: C) -> Traced {
        let mut traced = Traced::default();
        for path_idx in paths {
            self.tracer.trace(path_idx, &mut traced, &cx).await;
        }
        traced
    }
}

impl PhotonJob {
    pub(super) fn new(n_emitted: u32, per_root: u32) -> Self {
        Self {
            n_emitted,
            per_root,
            traced: Mutex::default(),
        }
    }

    /// The photons of all paths in order, once the run is over.
    pub(super) fn into_photons(self) -> (Vec<Photon>, PhotonCounts) {
        let by_root = self
            .traced
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        let mut counts = PhotonCounts::default();
        let mut photons = Vec::with_capacity(by_root.iter().map(|t| t.photons.len()).sum());
        for traced in by_root {
            counts.add(&traced.counts);
            photons.extend(traced.photons);
        }
        (photons, counts)
    }
}

impl<const CUTOUTS: bool, M: Media> Job<PhotonProgram<'_, CUTOUTS, M>> for PhotonJob {
    fn root(&self, number: u64) -> Option<Range<u32>> {
        let first = number.checked_mul(u64::from(self.per_root))?;
        let first = u32::try_from(first).ok().filter(|&n| n < self.n_emitted)?;
        let end = first.saturating_add(self.per_root).min(self.n_emitted);
        Some(first..end)
    }

    fn done(&self, number: u64, output: Traced) {
        let mut traced = self.traced.lock().unwrap_or_else(PoisonError::into_inner);
        let idx = number as usize;
        if traced.len() <= idx {
            traced.resize_with(idx + 1, Traced::default);
        }
        traced[idx] = output;
    }
}
