use std::time::Instant;

use kilauea_photon::PhotonMap;
use serde::Serialize;

use super::benefit::PhotonBenefit;
use super::trace::TracedPhotons;

/// What photons took, under the names that the statistics of a frame have for it.
#[derive(Clone, Debug, Serialize)]
pub struct PhotonReport {
    /// How many.
    pub photons: PhotonNumbers,
    /// Seconds.
    pub times: PhotonTimes,
    /// Rays.
    pub rays: PhotonRays,
    /// Bytes.
    pub memory: PhotonMemory,
    /// What the image gets of them, where that was asked.
    pub benefit: Option<PhotonBenefit>,
}

/// Numbers of photons.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PhotonNumbers {
    /// Paths that left lights.
    pub emitted: u64,
    /// Photons in the map.
    pub stored: u64,
    /// Of these, those that came over specular surfaces alone.
    pub caustic: u64,
    /// Photons that the map refused, as something of them was no number.
    pub rejected: u64,
}

/// Wall time.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PhotonTimes {
    /// Tracing.
    pub photon: f64,
    /// Building the map.
    pub map: f64,
}

/// Rays of photons.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PhotonRays {
    /// All of them.
    pub photon: u64,
    /// Those that could not be traced.
    pub invalid: u64,
}

/// Memory of photons.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PhotonMemory {
    /// Of the map.
    pub photons: u64,
}

impl PhotonReport {
    /// Builds the map of traced photons to see what it takes.
    pub fn of(traced: &TracedPhotons, benefit: Option<PhotonBenefit>) -> Self {
        let start = Instant::now();
        let map = PhotonMap::build(&traced.photons);
        let map_secs = start.elapsed().as_secs_f64();
        let counts = &traced.counts;
        Self {
            photons: PhotonNumbers {
                emitted: counts.emitted,
                stored: map.len() as u64,
                caustic: counts.stored_caustic,
                rejected: map.n_rejected() as u64,
            },
            times: PhotonTimes {
                photon: traced.seconds,
                map: map_secs,
            },
            rays: PhotonRays {
                photon: counts.rays,
                invalid: counts.invalid_rays,
            },
            memory: PhotonMemory {
                photons: map.bytes() as u64,
            },
            benefit,
        }
    }
}
