//! Whether the photons of a pass are divided among the members of a set.

use kilauea_scene::PhotonSplit;

use super::plan::CausticPlan;
use crate::frame::Frame;

/// Of a photon in a map, with its share of the tree.
pub(super) const BYTES_PER_PHOTON: u64 = 32;

impl CausticPlan<'_> {
    /// Whether the photons of a pass are divided: where each member would have no room for all of them.
    /// All members of a set find the same.
    pub(crate) fn divides(&self, frame: &Frame, pass: u32) -> bool {
        let Some(set) = frame
            .prepared
            .set
            .as_ref()
            .filter(|set| set.n_members() > 1)
        else {
            return false;
        };
        match frame.settings.photons.split {
            PhotonSplit::Always => true,
            PhotonSplit::Never => false,
            PhotonSplit::WhereNeeded => set.photon_bytes.is_some_and(|room| {
                let n_photons = f64::from(self.n_emitted(frame, pass)) * self.kept_per_path;
                n_photons * BYTES_PER_PHOTON as f64 > room as f64
            }),
        }
    }
}
