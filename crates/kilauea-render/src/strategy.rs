//! By which paths the samples of a frame are taken: what they are told beforehand, and with what code.
//!
//! Plain paths are compiled without what a scene does not have, and so are those that are told of
//! lights alone; all others once, for scenes that have everything: as often as these, they would take
//! minutes.

use std::ops::Range;
use std::sync::Arc;

use kilauea_scene::{GlobalIllumination, Integrator};

use crate::RenderError;
use crate::caustics::{CausticPlan, CausticSource};
use crate::final_gather::IrradianceCache;
use crate::frame::Frame;
use crate::gather::GatherEstimate;
use crate::integrator::{
    Aimed, Air, Guide, Guided, LightGuided, Media, MediumStack, Merge, PathIntegrator, Unguided,
    Unmerged,
};

impl Frame {
    /// Takes all samples.
    pub(crate) fn take_samples(&self) -> Result<(), RenderError> {
        let plan = CausticPlan::of(self)?;
        let learnt = match (&self.told, self.settings.integrator) {
            (_, Integrator::Path) => Arc::default(),
            (Some(told), Integrator::Kilauea) => Arc::clone(told),
            (None, Integrator::Kilauea) => match self.learn() {
                Ok(learnt) => Arc::new(learnt),
                Err(error) => return self.stopped_by(error),
            },
        };
        self.lock_outcome().learnt = Arc::clone(&learnt);
        let irradiance = match (self.settings.gi, self.settings.integrator) {
            (GlobalIllumination::Consistent, Integrator::Kilauea) => {
                self.find_irradiance(&learnt)?
            }
            _ => None,
        };
        match (plan, irradiance) {
            (Some(plan), None) if self.settings.gi == GlobalIllumination::Exact => {
                self.run_light_tracing(&plan, &learnt)
            }
            (Some(plan), irradiance) => self.run_merging(&plan, irradiance.as_ref(), &learnt),
            (None, Some(irradiance)) => self.run_gathering(&irradiance, &learnt),
            (None, None) => self.run_told(&learnt),
        }
    }

    /// Takes all samples by paths that look irradiance up.
    fn run_gathering(
        &self,
        irradiance: &IrradianceCache,
        learnt: &GatherEstimate,
    ) -> Result<(), RenderError> {
        let aims = self.find_aims()?;
        let aims = aims.as_ref().map(|field| Aimed { field });
        let gather = irradiance.gather(self, Unmerged);
        let passes = 0..self.passes.n_passes();
        let is_plain = aims.is_none() && learnt.directions.is_none() && !learnt.knows_lights();
        if is_plain && !self.needs.media && !self.needs_keys() {
            let integrator = self.integrator::<false, _>(Air);
            return self.run_some(integrator.merging_by(gather), passes);
        }
        let integrator = self.told(learnt, aims);
        self.run_some(integrator.merging_by(gather), passes)
    }

    /// Takes all samples by paths that are told what was learnt, and where light is bright and seldom
    /// found.
    fn run_told(&self, learnt: &GatherEstimate) -> Result<(), RenderError> {
        let aims = self.find_aims()?;
        let aims = aims.as_ref().map(|field| Aimed { field });
        let lights = learnt.lights();
        match (aims, &learnt.directions, learnt.knows_lights()) {
            (None, None, false) => self.run_unguided(),
            (None, None, true) => self.run_choosing_lights(LightGuided { lights }),
            (Some(aims), None, false) => self.run_general(aims),
            (aims, directions, _) => self.run_general(Guided {
                field: directions.as_ref(),
                aims,
                lights,
            }),
        }
    }

    fn run_unguided(&self) -> Result<(), RenderError> {
        match (self.needs.media, self.needs_keys()) {
            (false, false) => self.run_all::<false, _, _>(Air, Unguided),
            (false, true) => self.run_all::<true, _, _>(Air, Unguided),
            (true, false) => self.run_all::<false, _, _>(self.camera_media(), Unguided),
            (true, true) => self.run_general(Unguided),
        }
    }

    fn run_choosing_lights(&self, guide: LightGuided<'_>) -> Result<(), RenderError> {
        if self.needs.media || self.needs_keys() {
            self.run_general(guide)
        } else {
            self.run_all::<false, _, _>(Air, guide)
        }
    }

    /// Takes all samples by the code for scenes that have everything.
    fn run_general(&self, guide: impl Guide) -> Result<(), RenderError> {
        self.run_all::<true, _, _>(self.camera_media(), guide)
    }

    /// Takes all samples by one integrator.
    pub(crate) fn run_all<const CUTOUTS: bool, M: Media, G: Guide>(
        &self,
        camera_media: M,
        guide: G,
    ) -> Result<(), RenderError> {
        let integrator: PathIntegrator<'_, CUTOUTS, M> = self.integrator(camera_media);
        self.run_some(integrator.guided_by(guide), 0..self.passes.n_passes())
    }

    /// The integrator of paths that are told what was learnt, with the code for scenes that have everything.
    fn told<'s>(
        &'s self,
        learnt: &'s GatherEstimate,
        aims: Option<Aimed<'s>>,
    ) -> PathIntegrator<'s, true, MediumStack, Guided<'s>> {
        let integrator = self.integrator::<true, _>(self.camera_media());
        integrator.guided_by(Guided {
            field: learnt.directions.as_ref(),
            aims,
            lights: learnt.lights(),
        })
    }

    /// Takes all samples by paths that merge with photons, of which each pass has its own, and are
    /// told what was learnt.
    fn run_merging(
        &self,
        plan: &CausticPlan<'_>,
        irradiance: Option<&IrradianceCache>,
        learnt: &GatherEstimate,
    ) -> Result<(), RenderError> {
        let integrator = self.told(learnt, None);
        for pass in 0..self.passes.n_passes() {
            if self.is_clean() || self.is_late() {
                self.photons.end();
                break;
            }
            if self.is_over() {
                break;
            }
            if !self.begins(plan, pass) {
                continue;
            }
            let photons = plan.trace(self, pass)?;
            let passes = pass..pass + 1;
            match photons.source() {
                CausticSource::Here(map) => {
                    self.run_pass(integrator, photons.merge(map), irradiance, passes)
                }
                CausticSource::OfSet(source) => {
                    self.run_pass(integrator, photons.merge(source), irradiance, passes)
                }
            }?;
        }
        Ok(())
    }

    /// Takes all samples by paths that share light with photons that the camera sees, of which each pass
    /// has its own, and are told what was learnt, and where light is bright and seldom found.
    fn run_light_tracing(
        &self,
        plan: &CausticPlan<'_>,
        learnt: &GatherEstimate,
    ) -> Result<(), RenderError> {
        let aims = self.find_aims()?;
        let integrator = self.told(learnt, aims.as_ref().map(|field| Aimed { field }));
        for pass in 0..self.passes.n_passes() {
            if self.is_clean() || self.is_late() || self.is_over() {
                break;
            }
            let passes = pass..pass + 1;
            if self.has_work(&passes) {
                let splats = plan.trace_splats(self, pass)?;
                self.run_some(integrator.merging_by(splats.merge()), passes)?;
            }
        }
        Ok(())
    }

    /// Takes the samples of a pass by paths that merge with photons, and may look irradiance up.
    fn run_pass<M: Media, G: Guide>(
        &self,
        integrator: PathIntegrator<'_, true, M, G>,
        merge: impl Merge,
        irradiance: Option<&IrradianceCache>,
        pass: Range<u32>,
    ) -> Result<(), RenderError> {
        match irradiance {
            Some(irradiance) => {
                let gather = irradiance.gather(self, merge);
                self.run_some(integrator.merging_by(gather), pass)
            }
            None => self.run_some(integrator.merging_by(merge), pass),
        }
    }

    /// Waits until a pass begins; false where others have finished it before this frame began.
    fn begins(&self, plan: &CausticPlan<'_>, pass: u32) -> bool {
        if plan.divides(self, pass) {
            self.begins_divided(pass)
        } else {
            self.has_work(&(pass..pass + 1))
        }
    }

    /// Whether rays pass some of what they meet.
    fn needs_keys(&self) -> bool {
        self.needs.cutouts || self.needs.nested_media
    }
}
