//! Photons from lights through the scene (Jensen 1996, "Global Illumination using Photon Maps"), and
//! importons from the camera, which tell where they are of use.
//!
//! An [`Emitter`](crate::light::Emitter) sends photons out, a tracer follows them from surface to
//! surface, and each surface with a lobe rough enough to be looked at from anywhere keeps one. Paths
//! are SPOTs of the same engine as those of pixels and ask the same questions; their random numbers
//! depend on seed and number alone, so that photons are the same in any order and with any number of
//! threads.

mod benefit;
mod counts;
mod follow;
mod history;
mod horizons;
mod importon;
mod meeting;
mod picture;
mod report;
mod scatter;
mod surfaces;
mod trace;
mod tracer;

pub use benefit::{LightShares, PhotonBenefit, photon_benefit};
pub use counts::PhotonCounts;
pub use importon::{Importon, ImportonRequest, trace_importons};
pub use picture::photon_picture;
pub use report::{PhotonMemory, PhotonNumbers, PhotonRays, PhotonReport, PhotonTimes};
pub use trace::{PhotonRequest, TracedPhotons, trace_photons};

/// Roughness from which on a surface keeps photons, and below which scattering is specular for the
/// classes of photons: lobes that are narrower see too few photons of a map.
pub const MIN_ROUGHNESS: f32 = 0.05;
