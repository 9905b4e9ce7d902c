//! What room caustic photons may take, before any is traced.

use kilauea_scene::{GlobalIllumination, PhotonSplit, RenderSettings, Scene};

use super::division::BYTES_PER_PHOTON;
use super::pass::n_emitted;
use super::plan::{is_left_to_paths, n_per_sample, why_no_photons};
use crate::passes::largest_pass;
use crate::set::MOST_PASSES;

/// Room that caustic photons may take on the members of a set, by what is known before any is traced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PhotonDemand {
    /// Of all photons of the largest pass.
    map_bytes: u64,
    split: PhotonSplit,
}

/// Whether each pass of a frame's samples may have photons of its own, by what is known before any is traced.
pub fn may_have_photons_by_pass(settings: &RenderSettings) -> bool {
    settings.max_depth >= 2 && !is_left_to_paths(settings)
}

impl PhotonDemand {
    /// A photon for each path of light; nothing where none will be followed. A path leaves several where
    /// surfaces are mirrors and rough as well, which shows when they are met.
    pub fn of(scene: &Scene, settings: &RenderSettings) -> Self {
        let is_traced = settings.gi == GlobalIllumination::Consistent
            && why_no_photons(scene, &scene.camera, settings).is_none();
        let n_samples = largest_pass(settings.samples_per_pixel);
        let n_photons = n_emitted(n_per_sample(settings), n_samples);
        Self {
            map_bytes: if is_traced {
                u64::from(n_photons) * BYTES_PER_PHOTON
            } else {
                0
            },
            split: settings.photons.split,
        }
    }

    /// Bytes that one of so many members has to have for them. Where they are divided it keeps its part
    /// of the pass before, too. Nothing where one has the whole scene, which is not spread for the sake of
    /// its photons.
    pub fn of_member(&self, n_members: usize) -> u64 {
        let parts = (MOST_PASSES as u64 * self.map_bytes).div_ceil(n_members.max(1) as u64);
        match self.split {
            _ if n_members < 2 => 0,
            PhotonSplit::WhereNeeded => parts.min(self.map_bytes),
            PhotonSplit::Always => parts,
            PhotonSplit::Never => self.map_bytes,
        }
    }
}
