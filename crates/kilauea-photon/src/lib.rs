//! Photon maps: photons in little memory, found by place, and what follows from them.
//!
//! A tracer hands over [`Photon`]s; [`PhotonMap::build`] packs them and puts a tree above them. The map
//! is the same for any order of the photons and any number of threads, and so is what it answers.

#![forbid(unsafe_code)]

mod density;
mod kernel;
mod map;
mod merge;
mod packed;
mod photon;
mod progressive;
mod tree;

pub use density::{DensityRule, Irradiance, SurfaceQuery};
pub use kernel::Kernel;
pub use map::{PhotonMap, StoredPhoton};
pub use merge::{EyeSubpath, LightSubpath, Merging};
pub use photon::{Photon, PhotonClass};
pub use progressive::ProgressiveRadius;
pub use tree::Found;
