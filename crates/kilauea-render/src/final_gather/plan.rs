//! Whether paths look irradiance up, and by how many photons it is known.

use kilauea_scene::FinalGathering;

use super::irradiance::IrradianceCache;
use crate::RenderError;
use crate::frame::Frame;
use crate::gather::GatherEstimate;
use crate::needs::moves;
use crate::prepared::PreparedScene;

/// Paths of light for each path of a frame: measured, see decision 027.
const PHOTON_SHARE: f64 = 1.0 / 16.0;
/// Of these, those that tell where the others are to be sent.
const SCOUT_SHARE: f64 = 1.0 / 16.0;
/// Those by which it is told whether the others pay.
const PILOT_SHARE: f64 = 1.0 / 4.0;
/// A frame for which fewer were to be traced goes without.
const LEAST_PHOTONS: f64 = 4096.0;
/// For the sake of memory.
const MOST_PHOTONS: f64 = (1 << 21) as f64;
/// The same where a time limit may leave most samples untaken.
const MOST_IN_LIMITED_TIME: f64 = (1 << 18) as f64;
/// Apart from all seeds of pictures.
const SCOUT_SEED: u32 = 0x6667_6132;
const PILOT_SEED: u32 = 0x6667_6130;
const CACHE_SEED: u32 = 0x6667_6131;
/// Paths that find all light by themselves are left for others that are at least so much more efficient.
const LEAST_GAIN: f64 = 1.1;

impl Frame {
    /// Irradiance for paths to look up that are told what was learnt; none where that does not pay, for
    /// a reason that is in the frame's statistics then.
    pub(crate) fn find_irradiance(
        &self,
        learnt: &GatherEstimate,
    ) -> Result<Option<IrradianceCache>, RenderError> {
        let found = self.plan_irradiance(learnt)?;
        let mut outcome = self.lock_outcome();
        Ok(match found {
            Ok(cache) => Some(cache),
            Err(reason) => {
                let reason = format!("final gathering: {reason}");
                outcome.final_gather.skipped.push(reason);
                None
            }
        })
    }

    /// The irradiance, or the reason why there is none.
    fn plan_irradiance(
        &self,
        learnt: &GatherEstimate,
    ) -> Result<Result<IrradianceCache, String>, RenderError> {
        let is_forced = self.settings.photons.final_gathering == FinalGathering::Always;
        let n_asked = self.photons_asked();
        let reason = self
            .why_not_gather()
            .or((n_asked < LEAST_PHOTONS && !is_forced)
                .then_some("there are too few samples to tell whether it pays"));
        if let Some(reason) = reason {
            return Ok(Err(reason.to_owned()));
        }
        let n_emitted = match self.settings.time_limit_secs {
            Some(_) => n_asked.min(MOST_IN_LIMITED_TIME),
            None => n_asked.min(MOST_PHOTONS),
        };
        let emitter =
            self.aimed_emitter(SCOUT_SHARE, (SCOUT_SHARE * n_emitted) as u32, SCOUT_SEED)?;
        let trace = |share: f64, seed| {
            IrradianceCache::trace(self, &emitter, (share * n_emitted) as u32, seed)
        };
        let no_photons = || Ok(Err("no photons arrive at diffuse surfaces".to_owned()));
        if !is_forced {
            let Some(pilot) = trace(PILOT_SHARE, PILOT_SEED)? else {
                return no_photons();
            };
            if let Some(reason) = self.why_no_gain(&pilot, learnt)? {
                return Ok(Err(reason));
            }
        }
        match trace(1.0, CACHE_SEED)? {
            Some(cache) => Ok(Ok(cache)),
            None => no_photons(),
        }
    }

    /// Paths of light that a frame is to have. As many for each pixel, also for those that are not
    /// rendered, so that a part of a picture is as it is in the whole.
    fn photons_asked(&self) -> f64 {
        let settings = &self.settings;
        let n_pixels = settings.resolution.map(f64::from).iter().product::<f64>();
        let asked = settings.photons.emitted_per_sample.map(f64::from);
        asked.unwrap_or(PHOTON_SHARE * n_pixels) * f64::from(settings.samples_per_pixel)
    }

    /// Why irradiance cannot stand for what paths would find.
    fn why_not_gather(&self) -> Option<&'static str> {
        let prepared = &*self.prepared;
        let prototypes = &prepared.scene.prototypes;
        if self.settings.photons.final_gathering == FinalGathering::Never {
            Some("it is switched off")
        } else if self.settings.max_depth < 2 {
            Some("paths are too short")
        } else if prototypes.iter().any(moves) {
            Some("something moves while the shutter is open")
        } else if shines_without_photons(prepared) {
            Some("something emits of which there are no photons")
        } else {
            None
        }
    }

    /// Why the irradiance of more photons would not pay, by what that of a few brings, if it would not.
    fn why_no_gain(
        &self,
        pilot: &IrradianceCache,
        learnt: &GatherEstimate,
    ) -> Result<Option<String>, RenderError> {
        let Some(benefit) = self.try_gathering(pilot, learnt)? else {
            return Ok(Some("nothing is seen".to_owned()));
        };
        let gain = benefit.gain(PILOT_SHARE);
        let found = &mut self.lock_outcome().final_gather;
        found.gain = gain;
        found.squared_bias = benefit.squared_bias.value;
        let pays = gain >= LEAST_GAIN;
        Ok((!pays).then(|| format!("by a trial it would make paths {gain:.2} times as efficient")))
    }
}

/// Whether curves or points emit, which send out no photons. (What moves does not either.)
fn shines_without_photons(prepared: &PreparedScene) -> bool {
    let shaders = prepared.geometry.shaders();
    let emits = |material: u32| shaders[material as usize].is_emissive();
    let prototypes = &prepared.scene.prototypes;
    prototypes.iter().any(|prototype| {
        let curves = prototype.curves.iter().map(|chunk| chunk.material);
        let points = prototype.points.iter().map(|chunk| chunk.material);
        curves.chain(points).any(emits)
    })
}
