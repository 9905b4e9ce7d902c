//! Light sent where the picture needs it (Peter & Pietrek 1998, "Importance Driven Construction of
//! Photon Maps"): of a sky, most would never come into a room.

use std::num::NonZeroUsize;

use kilauea_math::Spectrum;
use kilauea_photon::{Photon, PhotonClass, PhotonMap, RadiusRule, SurfaceQuery};

use super::irradiance::{ON_ONE_SURFACE, farthest_of_record};
use crate::RenderError;
use crate::frame::Frame;
use crate::light::{Emitter, UsefulRay};
use crate::photon::{Importon, ImportonRequest, TracedPhotons, trace_importons, trace_scouts};

/// Light is left as it is where more of it arrives where it is looked up.
const MOST_SEEN: f64 = 0.5;
/// Paths from the camera that tell where that is, about.
const N_IMPORTONS: f64 = (1 << 13) as f64;
/// Importons that say how much is looked up at a place.
const N_NEAREST: NonZeroUsize = NonZeroUsize::new(8).expect("not zero");
/// More photons do not tell better where light is to go.
const MOST_ASKED: usize = 1 << 14;

impl Frame {
    /// The lights; by so many scouts, which are `share` of all paths of light, aimed at what brings light
    /// to where irradiance is looked up, if little arrives there.
    pub(super) fn aimed_emitter(
        &self,
        share: f64,
        n_scouts: u32,
        seed: u32,
    ) -> Result<Emitter<'_>, RenderError> {
        let prepared = &*self.prepared;
        let emitter = Emitter::new(&prepared.lights, &prepared.geometry, &prepared.textures);
        let request = self.irradiance_request(n_scouts, seed);
        let scouts = trace_scouts(prepared, &emitter, &request, self.path_share())?;
        self.note_irradiance(&scouts);
        let looked_up = self.where_irradiance_is_looked_up()?;
        let n_photons = (scouts.photons.len() as f64 / share) as usize;
        let (useful, seen) = useful(&scouts, &looked_up, farthest_of_record(&emitter, n_photons));
        self.lock_outcome().final_gather.seen = seen;
        let tells = seen < MOST_SEEN && useful.len() >= UsefulRay::MIN_TO_AIM;
        Ok(if tells {
            emitter.aimed_by(&useful)
        } else {
            emitter
        })
    }

    /// The second rough surfaces of paths from the camera, each with the share of its light that is seen.
    fn where_irradiance_is_looked_up(&self) -> Result<PhotonMap, RenderError> {
        let n_pixels = self
            .settings
            .resolution
            .map(f64::from)
            .iter()
            .product::<f64>();
        let request = ImportonRequest {
            block: (n_pixels / N_IMPORTONS).sqrt().max(1.0) as u32,
            max_rough: 2,
            ..ImportonRequest::of_pixels(self.settings.resolution, self.n_threads)
        };
        let importons = trace_importons(&self.prepared, &request)?;
        let second = importons.iter().filter(|importon| importon.n_rough == 1);
        Ok(PhotonMap::build(&second.map(as_photon).collect::<Vec<_>>()))
    }
}

fn as_photon(importon: &Importon) -> Photon {
    let seen = (importon.throughput * importon.albedo).luminance();
    Photon {
        p: importon.p,
        power: Spectrum::splat(seen),
        wi: importon.n,
        n: importon.n,
        light_idx: 0,
        class: PhotonClass::Global,
        path_idx: importon.block,
        depth: 0,
    }
}

/// How the light left that arrives within `max_radius` of where it is looked up, each with what it brings,
/// and the share that it has in all light that arrives.
fn useful(scouts: &TracedPhotons, looked_up: &PhotonMap, max_radius: f32) -> (Vec<UsefulRay>, f64) {
    let radius = RadiusRule::Nearest {
        k: N_NEAREST,
        max_radius,
    };
    let (mut useful, mut seen, mut all) = (Vec::new(), 0.0, 0.0);
    let stride = scouts.photons.len().div_ceil(MOST_ASKED).max(1);
    let both = scouts.photons.iter().zip(&scouts.useful_rays);
    for (photon, ray) in both.step_by(stride) {
        let query = SurfaceQuery {
            p: photon.p,
            n: photon.n,
        };
        let importance = looked_up.irradiance_by(&query, radius, &ON_ONE_SURFACE);
        let power = photon.power.luminance();
        all += f64::from(power);
        if importance.n_photons > 0 {
            seen += f64::from(power);
            useful.push(UsefulRay {
                luminance: power * importance.value.luminance(),
                ..*ray
            });
        }
    }
    (useful, if all > 0.0 { seen / all } else { 0.0 })
}
