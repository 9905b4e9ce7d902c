//! Numbered paths that are followed once for all who render a frame together.
//!
//! What a path leaves depends on its number alone, so that anyone may follow it, and those who need
//! what all left do not have to follow all.

use std::ops::Range;

use kilauea_spot::{RunError, Wire};
use serde::{Deserialize, Serialize};

use crate::follow::PATHS_PER_BLOCK;

/// A pass over numbered paths: the same one for all whose frame it is a part of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct PathPass {
    /// What is kept of the paths.
    pub kind: PathKind,
    /// What tells their numbers from those of other passes of the kind.
    pub seed: u32,
    /// Paths, numbered from zero.
    pub n_paths: u32,
}

/// What is kept of paths.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum PathKind {
    /// All photons.
    Photons,
    /// Photons that came over specular surfaces alone.
    CausticPhotons,
    /// Where light arrives that paths can be aimed at.
    Arrivals,
    /// What training paths find.
    Training,
    /// Pixels that are tried with what was learnt and without.
    Trial,
    /// Photons of what diffuse lobes receive.
    Irradiance,
    /// As caustic photons, of which each member of a set keeps a part.
    DividedCausticPhotons,
    /// What the camera sees of photons.
    Splats,
}

impl PathKind {
    /// As statistics call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Photons => "photons",
            Self::CausticPhotons => "caustic photons",
            Self::Arrivals => "aims",
            Self::Training => "training",
            Self::Trial => "trial",
            Self::Irradiance => "irradiance",
            Self::DividedCausticPhotons => "divided caustic photons",
            Self::Splats => "splats",
        }
    }

    /// Paths are shared out in multiples of this: whole blocks of those whose sums are made together, so
    /// that the bits of sums do not depend on who follows them, or few of those that take long.
    pub fn grain(self) -> u32 {
        match self {
            Self::Photons
            | Self::CausticPhotons
            | Self::DividedCausticPhotons
            | Self::Arrivals
            | Self::Irradiance
            | Self::Splats => 4 * PATHS_PER_BLOCK,
            Self::Training | Self::Trial => 16,
        }
    }
}

/// Shares paths out among those who render a frame. Called by one thread at a time.
pub trait PathShare: Send + Sync {
    /// Waits for paths that are to be followed here. None once all of the pass have been, by whomever,
    /// or the frame is over.
    fn take(&self, pass: PathPass) -> Option<Range<u32>>;

    /// Hands over what paths left that were taken.
    fn put(&self, pass: PathPass, paths: Range<u32>, left: Vec<u8>);

    /// What all paths left, in their order, once none are to be taken any more. None where the frame
    /// is over: no unit of it may be taken any more by then.
    fn collect(&self, pass: PathPass) -> Option<Vec<Vec<u8>>>;
}

/// Follows the paths that are to be followed here, all where none are shared out, and has what all of
/// them left, as if all had been: `follow` follows some, and tells what they left in the order of their
/// numbers, some together. Nothing where the frame is over, as nobody looks at it.
pub(crate) fn follow_shared<L: Wire>(
    share: Option<&dyn PathShare>,
    pass: PathPass,
    follow: impl Fn(Range<u32>) -> Result<Vec<L>, RunError>,
) -> Result<Vec<L>, RunError> {
    let Some(share) = share else {
        return follow(0..pass.n_paths);
    };
    while let Some(paths) = share.take(pass) {
        let left = follow(paths.clone())?;
        let mut bytes = Vec::new();
        for left in &left {
            left.encode(&mut bytes);
        }
        share.put(pass, paths, bytes);
    }
    let mut all = Vec::new();
    for bytes in share.collect(pass).unwrap_or_default() {
        let mut rest = &bytes[..];
        while !rest.is_empty() {
            let left = L::decode(&mut rest).map_err(|source| RunError::Malformed {
                n_bytes: bytes.len(),
                source,
            })?;
            all.push(left);
        }
    }
    Ok(all)
}
