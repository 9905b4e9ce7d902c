//! Processes of workers that stay between frames, with the scene that they have.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::console::WorkerProcess;

/// Workers that have nothing to do until the next frame; they end with the last copy of this. Those
/// of a frame that were there to its end are kept, and no others. Only workers of the kind
/// [`crate::WorkerKind::Processes`] stay.
#[derive(Clone, Debug, Default)]
pub struct Crew(Arc<Mutex<Vec<Idle>>>);

#[derive(Debug)]
struct Idle {
    process: WorkerProcess,
    fit: Fit,
}

/// What workers must have in common to be exchanged: how they were started and how they prepare.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Fit {
    pub(crate) program: PathBuf,
    pub(crate) arguments: Vec<OsString>,
    pub(crate) specialize_rays: bool,
    pub(crate) texture_memory_bytes: u64,
}

impl Crew {
    /// How many wait.
    pub fn n_idle(&self) -> usize {
        self.lock().len()
    }

    /// Takes one that fits and lives. Those met that do not end here.
    pub(crate) fn take(&self, fit: &Fit) -> Option<WorkerProcess> {
        let mut idle = self.lock();
        while let Some(Idle {
            mut process,
            fit: of,
        }) = idle.pop()
        {
            if of == *fit && process.ended().is_none() {
                return Some(process);
            }
        }
        None
    }

    /// Keeps the workers of a frame instead of those that were left over.
    pub(crate) fn keep(&self, processes: impl Iterator<Item = WorkerProcess>, fit: &Fit) {
        let keep = |process| Idle {
            process,
            fit: fit.clone(),
        };
        *self.lock() = processes.map(keep).collect();
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Idle>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
