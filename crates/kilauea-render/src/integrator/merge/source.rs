//! Where look-ups find their photons: in a map that is here, or among the members of a set.

use std::sync::atomic::{AtomicU32, Ordering};

use kilauea_bsdf::SeenBsdf;
use kilauea_math::Spectrum;
use kilauea_photon::{Kernel, LightSum, LightUnit, Merging, PhotonMap, SurfaceQuery};

use super::ArrivingPhoton;
use crate::integrator::guide::Knowledge;
use crate::integrator::question::{Answer, PhotonQuestion, Question};
use crate::photon::MIN_ROUGHNESS;

/// Light scattered by diffuse lobes, and by all others.
pub(super) type ByLobes = [Spectrum; 2];

/// How the light of photons is weighed and added up: the same bits in whatever order they come.
#[derive(Clone, Copy)]
pub(crate) struct Gathering {
    pub(crate) merging: Merging,
    /// Engine space.
    pub(crate) radius: f32,
    pub(crate) unit: LightUnit,
}

/// A vertex that takes the light of photons.
pub(crate) struct Lookup<'b, K> {
    pub(super) query: SurfaceQuery,
    pub(super) bsdf: &'b SeenBsdf,
    pub(super) knowledge: &'b K,
    /// Fraction of light that passes on the way to the vertex before.
    pub(super) passed: Spectrum,
}

/// The light of photons at a vertex, as far as it is added up.
struct Gathered<'g, 'b, K> {
    gathering: &'g Gathering,
    lookup: &'g Lookup<'b, K>,
    has_narrow_lobes: bool,
    diffuse: LightSum,
    specular: LightSum,
}

impl<'g, 'b, K: Knowledge> Gathered<'g, 'b, K> {
    fn nothing(gathering: &'g Gathering, lookup: &'g Lookup<'b, K>) -> Self {
        Self {
            gathering,
            lookup,
            has_narrow_lobes: lookup.bsdf.has_narrow_lobes(MIN_ROUGHNESS),
            diffuse: LightSum::default(),
            specular: LightSum::default(),
        }
    }

    #[inline]
    fn add(&mut self, photon: &ArrivingPhoton) {
        let Gathering {
            merging,
            radius,
            unit,
        } = *self.gathering;
        let Lookup {
            query,
            bsdf,
            knowledge,
            ..
        } = self.lookup;
        let mut eval = bsdf.eval(photon.wi);
        if self.has_narrow_lobes {
            // What they scatter of photons, paths go on for.
            eval.specular = (eval.specular - bsdf.eval_narrow(photon.wi, MIN_ROUGHNESS)).max(0.0);
        }
        let pdf = knowledge.pdf(bsdf, photon.wi, eval.pdf);
        // Photons arrive by the area of the true surface; the BSDF has the cosine to the shading
        // normal (Veach 1997, eq. 5.19).
        let cos_true = photon.wi.dot(query.n);
        let weight = merging.weight_of_photon(photon.d_eye, pdf);
        let per_area = Kernel::default().weight(photon.d_sq, radius * radius);
        let light = photon.power * (weight * per_area / cos_true);
        self.diffuse.add(eval.diffuse * light, unit);
        self.specular.add(eval.specular * light, unit);
    }

    fn light(&self) -> ByLobes {
        let unit = self.gathering.unit;
        [self.diffuse, self.specular].map(|sum| sum.total(unit) * self.lookup.passed)
    }
}

/// Where look-ups find their photons.
pub(crate) trait PhotonSource: Copy + Send + Sync {
    /// What a path keeps while it waits for photons: for answers `R`, by what it knows, `K`.
    type Asked<R, K>: Default;

    /// The light that a vertex scatters, or nothing yet where it must be asked for.
    fn look_up<R, K: Knowledge>(
        &self,
        gathering: &Gathering,
        lookup: &Lookup<'_, K>,
        ask: impl FnOnce(Question) -> R,
        asked: &mut Self::Asked<R, K>,
    ) -> Option<ByLobes>;

    /// The light that was asked for, if any was.
    fn receive<R, K: Knowledge>(
        &self,
        gathering: &Gathering,
        asked: &mut Self::Asked<R, K>,
    ) -> impl Future<Output = Option<ByLobes>>
    where
        R: Future<Output = Answer> + Unpin;
}

impl PhotonSource for &PhotonMap {
    type Asked<R, K> = ();

    #[inline]
    fn look_up<R, K: Knowledge>(
        &self,
        gathering: &Gathering,
        lookup: &Lookup<'_, K>,
        _: impl FnOnce(Question) -> R,
        (): &mut (),
    ) -> Option<ByLobes> {
        let mut gathered = Gathered::nothing(gathering, lookup);
        ArrivingPhoton::for_each(self, &lookup.query, gathering.radius, |photon| {
            gathered.add(photon);
        });
        Some(gathered.light())
    }

    #[inline(always)]
    fn receive<R, K: Knowledge>(
        &self,
        _: &Gathering,
        (): &mut (),
    ) -> impl Future<Output = Option<ByLobes>>
    where
        R: Future<Output = Answer> + Unpin,
    {
        std::future::ready(None)
    }
}

/// The members of a set, each of which has a part of the photons of a pass.
#[derive(Clone, Copy)]
pub(crate) struct PhotonsOfSet<'a> {
    pub(crate) pass: u32,
    /// Takes the number after that of a pass whose photons are gone.
    pub(crate) lost: &'a AtomicU32,
}

/// A look-up under way. In a box, as room for it would be in the state of every path.
pub(crate) struct LookupUnderWay<R, K> {
    reply: R,
    query: SurfaceQuery,
    bsdf: SeenBsdf,
    knowledge: K,
    passed: Spectrum,
}

impl PhotonSource for PhotonsOfSet<'_> {
    type Asked<R, K> = Option<Box<LookupUnderWay<R, K>>>;

    fn look_up<R, K: Knowledge>(
        &self,
        _: &Gathering,
        lookup: &Lookup<'_, K>,
        ask: impl FnOnce(Question) -> R,
        asked: &mut Self::Asked<R, K>,
    ) -> Option<ByLobes> {
        *asked = Some(Box::new(LookupUnderWay {
            reply: ask(Question::Photons(PhotonQuestion {
                pass: self.pass,
                at: lookup.query,
                n_told: 0,
            })),
            query: lookup.query,
            bsdf: lookup.bsdf.clone(),
            knowledge: *lookup.knowledge,
            passed: lookup.passed,
        }));
        None
    }

    async fn receive<R, K: Knowledge>(
        &self,
        gathering: &Gathering,
        asked: &mut Self::Asked<R, K>,
    ) -> Option<ByLobes>
    where
        R: Future<Output = Answer> + Unpin,
    {
        let mut under_way = asked.take()?;
        let photons = (&mut under_way.reply).await.photons();
        if photons.is_none() {
            self.lost.store(self.pass + 1, Ordering::Release);
        }
        let lookup = Lookup {
            query: under_way.query,
            bsdf: &under_way.bsdf,
            knowledge: &under_way.knowledge,
            passed: under_way.passed,
        };
        let mut gathered = Gathered::nothing(gathering, &lookup);
        for photon in &photons.unwrap_or_default() {
            gathered.add(photon);
        }
        Some(gathered.light())
    }
}
