//! Photon maps: photons in little memory, found by place, and what follows from them.
//!
//! A tracer hands over [`Photon`]s; [`PhotonMap::build`] packs them and puts a tree above them. The map
//! is the same for any order of the photons and any number of threads, and so is what it answers.

#![forbid(unsafe_code)]

mod density;
mod map;
mod merge;
mod morton;
mod packed;
pub mod partial;
mod photon;
mod progressive;
mod radiance;
mod tree;

pub use density::{DensityRule, Irradiance, Kernel, NearPhoton, RadiusRule, SurfaceQuery};
pub use map::{PhotonMap, StoredPhoton};
pub use merge::{EyeSubpath, LightSubpath, Merging};
pub use photon::{Photon, PhotonClass};
pub use progressive::ProgressiveRadius;
pub use radiance::{RadianceCache, RadianceLookups};
pub use tree::Found;
