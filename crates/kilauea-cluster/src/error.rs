use std::io;

use kilauea_render::{PlacementError, RenderError};

use crate::journal::JournalError;

/// Why a frame cannot be rendered by workers.
#[derive(Debug, thiserror::Error)]
pub enum ClusterError {
    /// Nobody could render it.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The scene cannot be spread.
    #[error(transparent)]
    Placement(#[from] PlacementError),
    /// Workers would be left over.
    #[error("{n_workers} workers cannot be divided into sets of {size}")]
    SetSize {
        /// All workers.
        n_workers: u32,
        /// Of a set.
        size: u32,
    },
    /// A worker found out that nobody can render it.
    #[error("{0}")]
    Failed(String),
    /// There are no workers left, and no more may be started.
    #[error(
        "no worker is left after {n_started} were started; the last one: {reason}{}",
        if *.is_kept { " (--resume goes on from what was rendered)" } else { "" }
    )]
    NoWorkers {
        /// How many there were.
        n_started: u32,
        /// What became of the last.
        reason: String,
        /// Whether a journal has what was rendered.
        is_kept: bool,
    },
    /// The journal cannot be used.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The system refuses something that everything needs.
    #[error("cannot start workers: {0}")]
    Io(#[from] io::Error),
    /// A bug.
    #[error("internal error: {0}")]
    Internal(&'static str),
}
