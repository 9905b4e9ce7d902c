//! Photons that are divided among the members of a set, by their paths.

use kilauea_math::hash::mix32;
use kilauea_photon::Photon;
use kilauea_spot::{Wire, WireError};

use super::tracer::LeftPhotons;
use crate::share::{PathKind, PathPass, PathShare};

/// The photons that a member of a set keeps: those of paths that fall to it by chance. By the paths'
/// numbers in turn it would get those of some lights alone, as numbers are stratified.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PhotonPart {
    /// The member.
    pub number: usize,
    /// Of so many.
    pub n_members: usize,
}

impl PhotonPart {
    /// Whether a photon is one of them.
    pub(crate) fn has(self, photon: &Photon) -> bool {
        mix32(photon.path_idx) as usize % self.n_members == self.number
    }

    /// What paths left without the photons that others keep, where those of the pass are divided. What
    /// cannot be read is left to whoever reads it.
    pub fn thin(self, pass: PathPass, left: Vec<u8>) -> Vec<u8> {
        if pass.kind != PathKind::DividedCausticPhotons {
            return left;
        }
        self.without_others(&left).unwrap_or(left)
    }

    fn without_others(self, left: &[u8]) -> Result<Vec<u8>, WireError> {
        let mut thinned = Vec::new();
        let mut rest = left;
        while !rest.is_empty() {
            let mut left = LeftPhotons::decode(&mut rest)?;
            left.photons.retain(|photon| self.has(photon));
            left.encode(&mut thinned);
        }
        Ok(thinned)
    }
}

/// Shares out paths whose photons are divided.
pub(crate) struct DividedPaths<'a>(pub(crate) &'a dyn PathShare);

impl PathShare for DividedPaths<'_> {
    fn take(&self, pass: PathPass) -> Option<std::ops::Range<u32>> {
        self.0.take(divided(pass))
    }

    fn put(&self, pass: PathPass, paths: std::ops::Range<u32>, left: Vec<u8>) {
        self.0.put(divided(pass), paths, left);
    }

    fn collect(&self, pass: PathPass) -> Option<Vec<Vec<u8>>> {
        self.0.collect(divided(pass))
    }
}

fn divided(pass: PathPass) -> PathPass {
    PathPass {
        kind: PathKind::DividedCausticPhotons,
        ..pass
    }
}
