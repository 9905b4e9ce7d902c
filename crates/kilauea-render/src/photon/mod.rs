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
mod lobes;
mod meeting;
mod part;
mod picture;
mod report;
mod scatter;
mod surfaces;
mod trace;
mod tracer;

pub(crate) use benefit::{IMPORTON_BLOCK, N_PILOT, Pilot, pilot};
pub use benefit::{LightShares, PhotonBenefit, photon_benefit};
pub use counts::PhotonCounts;
pub use importon::{Importon, ImportonRequest, trace_importons};
pub use lobes::MIN_ROUGHNESS;
pub(crate) use lobes::{DrawnLobes, LOBES_KEY, is_specular};
pub(crate) use part::DividedPaths;
pub use part::PhotonPart;
pub use picture::photon_picture;
pub use report::{PhotonMemory, PhotonNumbers, PhotonRays, PhotonReport, PhotonTimes};
pub(crate) use scatter::adjoint_pdf;
pub use trace::{PhotonRequest, TracedPhotons, trace_photons};
pub(crate) use trace::{
    SplatView, TracedArrivals, trace_arrivals, trace_caustic_photons, trace_irradiance,
    trace_photons_shared, trace_scouts, trace_splats,
};
