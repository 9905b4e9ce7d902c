//! Photon maps: photons in little memory, found by place, and what follows from them.
//!
//! A tracer hands over [`Photon`]s; [`PhotonMap::build`] packs them in 24 bytes each (28 where there are
//! caustic ones) and puts a tree of 3.4 bytes a photon above them. The map is the same for any order
//! of the photons and any number of threads, and so is what it answers: photons near a place,
//! irradiance from their density ([`DensityRule`]), irradiance that was computed beforehand
//! ([`RadianceCache`]), and irradiance from several maps that hold a share each ([`partial`]).
//!
//! One thread builds about a million photons a second and estimates irradiance from 75 photons of a
//! million half a million times a second, if it is asked in an order that keeps neighbours together
//! (`examples/lookups.rs`).
//!
//! ```
//! use kilauea_math::{Spectrum, Vec3};
//! use kilauea_photon::{DensityRule, Kernel, Photon, PhotonClass, PhotonMap, SurfaceQuery};
//!
//! // One watt on a floor.
//! let photon = Photon {
//!     p: Vec3::new(0.1, 0.0, 0.0),
//!     power: Spectrum::ONE,
//!     wi: Vec3::Z,
//!     n: Vec3::Z,
//!     light_idx: 0,
//!     class: PhotonClass::Global,
//!     path_idx: 0,
//!     depth: 0,
//! };
//! let map = PhotonMap::build(&[photon]);
//! let rule = DensityRule { kernel: Kernel::Constant, ..DensityRule::default() };
//! let query = SurfaceQuery { p: Vec3::ZERO, n: Vec3::Z };
//! let irradiance = map.irradiance(&query, 0.5, &rule);
//! assert!((irradiance.value[0] - 1.0 / (std::f32::consts::PI * 0.25)).abs() < 1e-5);
//! ```

#![forbid(unsafe_code)]

mod density;
mod light_sum;
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
pub use light_sum::{LightSum, LightUnit};
pub use map::{PhotonMap, StoredPhoton};
pub use merge::{EyeSubpath, LightSubpath, Merging};
pub use photon::{Photon, PhotonClass};
pub use progressive::ProgressiveRadius;
pub use radiance::{CachedIrradiance, RadianceCache, RadianceLookups};
pub use tree::Found;
