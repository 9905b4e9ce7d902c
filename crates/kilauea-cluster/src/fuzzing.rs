//! Readers that are nobody else's business, for tests that feed them damaged bytes.

use std::path::Path;

use kilauea_render::CollectedFrame;
use kilauea_scene::RenderSettings;

use crate::console::restore;
use crate::error::ClusterError;
use crate::journal::Journal;
use crate::ledger::Ledger;
use crate::plan::Plan;
use crate::protocol::{Frame, Manifest};

/// What a journal must be of to be opened by [`open_journal`].
pub fn manifest() -> Manifest {
    Manifest {
        build_hash: 1,
        scene_hash: [2; 32],
        settings_hash: [3; 32],
    }
}

/// Opens a journal as a console does, and puts its results into a frame.
pub fn open_journal(path: &Path, settings: &RenderSettings) -> Result<(), ClusterError> {
    let mut frame = CollectedFrame::new(settings)?;
    let plan = Plan::new(&frame, settings, 1);
    let mut ledger = Ledger::new(plan, std::time::Duration::ZERO);
    let restore = |kept: &Frame| restore(&mut frame, &mut ledger, kept);
    Journal::open(path, &manifest(), restore)?;
    Ok(())
}
