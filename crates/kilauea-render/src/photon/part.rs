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

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_math::{Spectrum, Vec3};
    use kilauea_photon::PhotonClass;

    fn photon(path_idx: u32) -> Photon {
        Photon {
            p: Vec3::X,
            power: Spectrum::ONE,
            wi: Vec3::Z,
            n: Vec3::Z,
            light_idx: 0,
            class: PhotonClass::Global,
            path_idx,
            depth: 1,
        }
    }

    /// Two records of paths, as bytes.
    fn left() -> Vec<u8> {
        let mut bytes = Vec::new();
        for paths in [0..500, 500..600] {
            let left = LeftPhotons {
                photons: paths.map(photon).collect(),
                brightest: 3.0,
                ..LeftPhotons::default()
            };
            left.encode(&mut bytes);
        }
        bytes
    }

    fn pass(kind: PathKind) -> PathPass {
        PathPass {
            kind,
            seed: 0,
            n_paths: 600,
        }
    }

    /// The paths whose photons there are.
    fn paths(mut bytes: &[u8]) -> Vec<u32> {
        let mut paths = Vec::new();
        while !bytes.is_empty() {
            let left = LeftPhotons::decode(&mut bytes).expect("it is whole");
            assert_eq!(left.brightest, 3.0, "known to all");
            paths.extend(left.photons.iter().map(|photon| photon.path_idx));
        }
        paths
    }

    #[test]
    fn each_photon_is_with_one_member() {
        let mut all = Vec::new();
        for number in 0..3 {
            let part = PhotonPart {
                number,
                n_members: 3,
            };
            let thinned = part.thin(pass(PathKind::DividedCausticPhotons), left());
            let own = paths(&thinned);
            assert!((150..250).contains(&own.len()), "{}", own.len());
            assert!(thinned.len() < left().len() / 2);
            all.extend(own);
            let whole = part.thin(pass(PathKind::CausticPhotons), left());
            assert_eq!(whole, left(), "not divided");
        }
        all.sort_unstable();
        assert_eq!(all, (0..600).collect::<Vec<_>>());
    }

    #[test]
    fn what_cannot_be_read_stays_as_it_is() {
        let part = PhotonPart {
            number: 0,
            n_members: 2,
        };
        let cut = &left()[..100];
        let thinned = part.thin(pass(PathKind::DividedCausticPhotons), cut.to_vec());
        assert_eq!(thinned, cut);
    }
}
