//! Photons from lights through the scene (Jensen 1996, "Global Illumination using Photon Maps"), and
//! importons from the camera, which tell where they are of use.
//!
//! `light::Emitter` sends photons out, a tracer follows them from surface to
//! surface, and each surface with a lobe rough enough to be looked at from anywhere keeps one. Paths
//! are SPOTs of the same engine as those of pixels and ask the same questions; their random numbers
//! depend on seed and number alone, so that photons are the same in any order and with any number of
//! threads.

mod benefit;
mod counts;
mod history;
mod horizons;
mod importon;
mod left_wire;
mod meeting;
mod part;
mod picture;
mod report;
mod scatter;
mod surfaces;
mod trace;
mod tracer;

use kilauea_bsdf::SeenBsdf;

pub(crate) use benefit::{IMPORTON_BLOCK, N_PILOT, Pilot, pilot};
pub use benefit::{LightShares, PhotonBenefit, photon_benefit};
pub use counts::PhotonCounts;
pub use importon::{Importon, ImportonRequest, trace_importons};
pub(crate) use part::DividedPaths;
pub use part::PhotonPart;
pub use picture::photon_picture;
pub use report::{PhotonMemory, PhotonNumbers, PhotonRays, PhotonReport, PhotonTimes};
pub(crate) use scatter::adjoint_pdf;
pub use trace::{PhotonRequest, TracedPhotons, trace_photons};
pub(crate) use trace::{
    TracedArrivals, trace_arrivals, trace_caustic_photons, trace_irradiance, trace_photons_shared,
    trace_scouts,
};

/// Roughness from which on a surface keeps photons, and below which scattering is specular for the
/// classes of photons: lobes that are narrower see too few photons of a map.
pub const MIN_ROUGHNESS: f32 = 0.05;

/// Whether scattering counts as specular: as a mirror does, or by a surface without any rough lobe.
///
/// Not by the lobe that was drawn, so that a path is of one class however it was found: several
/// lobes of a surface may scatter into one direction.
pub(crate) fn is_specular(is_delta: bool, bsdf: &SeenBsdf) -> bool {
    is_delta || bsdf.max_roughness() < Some(MIN_ROUGHNESS)
}
