//! Final gathering: irradiance from photons, computed before the paths that look it up where they
//! meet a second rough surface (Jensen 1996, "Global Illumination using Photon Maps"; Christensen 1999,
//! "Faster Photon Map Global Illumination").

mod aim;
mod irradiance;
mod plan;
mod trial;

pub(crate) use irradiance::IrradianceCache;
