//! Readers that are nobody else's business, for tests that feed them damaged bytes.

use std::path::Path;

use kilauea_render::CollectedFrame;
use kilauea_scene::{Camera, RenderSettings};

use crate::console::restore;
use crate::error::ClusterError;
use crate::journal::Journal;
use crate::ledger::Ledger;
use crate::plan::Plan;
use crate::protocol::{Frame, Manifest};
use crate::scene::{SceneBytesError, camera_from_bytes, camera_to_bytes};

/// What a journal must be of to be opened by [`open_journal`].
pub fn manifest() -> Manifest {
    Manifest {
        build_hash: 1,
        scene_hash: [2; 32],
        settings_hash: [3; 32],
    }
}

/// A camera as it comes with [`crate::protocol::Start`].
pub fn camera() -> Vec<u8> {
    camera_to_bytes(&Camera::default())
}

/// Reads one.
pub fn read_camera(bytes: &[u8]) -> Result<(), SceneBytesError> {
    camera_from_bytes(bytes).map(drop)
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
