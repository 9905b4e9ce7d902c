//! Paths that end at their second rough vertex, with irradiance that is known there (Jensen 1996;
//! Christensen 1999).

use kilauea_bsdf::{BsdfEval, Mirror, SeenBsdf};
use kilauea_math::hash::unit_f32;
use kilauea_math::{INV_PI, Spectrum};
use kilauea_photon::{RadianceCache, SurfaceQuery};

use super::caustics::normal_toward;
use super::{Merge, Rest, SharedConnection};
use crate::geometry::Geometry;
use crate::integrator::guide::Knowledge;
use crate::integrator::media::Media;
use crate::integrator::question::{Answer, Question};
use crate::integrator::roulette::survival_of;
use crate::integrator::walk::{Path, Segment, Vertex};
use crate::light::{ChosenLight, Emitted};
use crate::photon::is_specular;
use crate::sampler::Sampler;

/// Looks up at the second vertex what its diffuse lobes scatter, if the first was rough: light that
/// comes straight from lights, and all other. The path goes on by other lobes alone. At the first
/// vertex photons are shared by `X`.
#[derive(Clone, Copy)]
pub(crate) struct FinalGather<'a, X> {
    pub(crate) cache: &'a RadianceCache,
    pub(crate) geometry: &'a Geometry,
    /// How far photons of a record are at most, engine space.
    pub(crate) max_radius: f32,
    pub(crate) merge: X,
}

/// What a path that gathers keeps of its way.
#[derive(Clone, Copy)]
pub(crate) struct GatheringEye<E> {
    eye: E,
    stage: Stage,
    /// Light that was looked up, scattered.
    found: Option<Spectrum>,
}

#[derive(Clone, Copy)]
enum Stage {
    /// At the first vertex.
    First,
    /// Has been scattered by a rough surface that it met first.
    BehindRough,
    /// Has looked up light, and looks for more by those lobes.
    LookedUp(Rest),
    /// Finds all light by itself.
    Alone,
}

/// Scattering events before the vertex where light is looked up. Not where specular surfaces come
/// before: photons that bring light there have met as many surfaces as that leaves to them.
const DEPTH: u32 = 1;
/// Tells roulette for other lobes from all else that is decided at a vertex.
const ROULETTE_KEY: u32 = 0x2000_0000;

impl<X: Merge> FinalGather<'_, X> {
    /// Light that the diffuse lobes of a vertex scatter to the one before; none where nothing is known.
    fn known<M: Media>(
        &self,
        way: Segment<'_>,
        media: &M,
        vertex: &Vertex<'_, M>,
        bsdf: &SeenBsdf,
    ) -> Option<Spectrum> {
        let albedo = bsdf.diffuse_albedo();
        if albedo.is_black() || media.least_priority(self.geometry) != i8::MIN {
            return None;
        }
        let surface = &vertex.interaction.surface;
        let n = normal_toward(surface.ng, surface.wo);
        // Area that a path stands for which took this direction (Bekaert, Slusallek, Cools, Havran &
        // Seidel 2003, "A Custom Designed Density Estimation Method for Light Transport").
        let distance_sq = (surface.p - way.ray.origin).length_squared();
        let footprint = distance_sq / (way.departure.pdf * n.dot(surface.wo));
        let max_radius = footprint.sqrt().min(self.max_radius);
        let query = SurfaceQuery { p: surface.p, n };
        let found = self.cache.lookup(&query, max_radius)?;
        (found.radius <= max_radius).then(|| albedo * found.value * INV_PI * vertex.passed)
    }

    /// Whether light is looked for by other lobes, which scatter `throughput` of it to the camera.
    fn rest(throughput: Spectrum, sampler: &Sampler<'_>) -> Rest {
        if throughput.is_black() {
            return Rest::Nothing;
        }
        let survival = survival_of(throughput);
        if unit_f32(sampler.key(ROULETTE_KEY | DEPTH)) < survival {
            Rest::Others {
                weight: 1.0 / survival,
            }
        } else {
            Rest::Nothing
        }
    }
}

impl<X: Merge> Merge for FinalGather<'_, X> {
    type Eye = GatheringEye<X::Eye>;
    type Asked<R, K> = X::Asked<R, K>;

    fn start(&self) -> Self::Eye {
        GatheringEye {
            eye: self.merge.start(),
            stage: Stage::First,
            found: None,
        }
    }

    fn look_up<M: Media>(
        &self,
        path: &mut Path<M, Self::Eye>,
        vertex: &Vertex<'_, M>,
        (bsdf, shows_glint): (&SeenBsdf, bool),
        sampler: &Sampler<'_>,
    ) {
        if vertex.depth != DEPTH || !matches!(path.eye.stage, Stage::BehindRough) {
            return;
        }
        let known = path
            .segment()
            .and_then(|way| self.known(way, &path.media, vertex, bsdf));
        if let Some(light) = known {
            let others = (bsdf.albedo() - bsdf.diffuse_albedo()).max(0.0);
            let arriving = path.throughput.arriving(DEPTH) * vertex.passed;
            path.eye.found = Some(light);
            path.eye.stage = Stage::LookedUp(if shows_glint {
                Rest::Others { weight: 1.0 }
            } else {
                Self::rest(arriving * others, sampler)
            });
        }
    }

    fn rest(eye: &Self::Eye) -> Rest {
        match eye.stage {
            Stage::LookedUp(rest) => rest,
            Stage::First | Stage::BehindRough | Stage::Alone => Rest::All,
        }
    }

    fn gather<M, R, K: Knowledge>(
        &self,
        eye: &mut Self::Eye,
        vertex: &Vertex<'_, M>,
        lobes: (&SeenBsdf, &K),
        ask: impl FnOnce(Question) -> R,
        asked: &mut Self::Asked<R, K>,
    ) -> bool {
        let merge = &self.merge;
        eye.found.is_some() || merge.gather(&mut eye.eye, vertex, lobes, ask, asked)
    }

    fn receive<R, K: Knowledge>(
        &self,
        eye: &mut Self::Eye,
        asked: &mut Self::Asked<R, K>,
    ) -> impl Future<Output = ()>
    where
        R: Future<Output = Answer> + Unpin,
    {
        self.merge.receive(&mut eye.eye, asked)
    }

    fn take(eye: &mut Self::Eye) -> Option<[Spectrum; 2]> {
        match eye.found.take() {
            Some(light) => Some([light, Spectrum::BLACK]),
            None => X::take(&mut eye.eye),
        }
    }

    fn depart<M>(
        &self,
        eye: &mut Self::Eye,
        way: Segment<'_>,
        vertex: &Vertex<'_, M>,
        lobes: [&SeenBsdf; 2],
        sampler: &Sampler<'_>,
    ) -> [Spectrum; 2] {
        let [bsdf, _] = lobes;
        let Segment { departure, ray } = way;
        // Photons do not know that light was looked up here.
        let departure = match eye.stage {
            Stage::LookedUp(_) if departure.is_delta => {
                departure.with_pdf(departure.pdf * (1.0 - bsdf.probability_of_diffuse()))
            }
            Stage::LookedUp(_) => departure.with_pdf(bsdf.eval(ray.dir).pdf),
            _ => *departure,
        };
        let is_first = matches!(eye.stage, Stage::First);
        eye.stage = if is_first && !is_specular(departure.is_delta, bsdf) {
            Stage::BehindRough
        } else {
            Stage::Alone
        };
        let departure = &departure;
        let way = Segment { departure, ray };
        self.merge.depart(&mut eye.eye, way, vertex, lobes, sampler)
    }

    fn weight_of_hit(
        &self,
        eye: &Self::Eye,
        way: Option<Segment<'_>>,
        emitted: &Emitted,
        distance: f32,
    ) -> Option<f32> {
        self.merge.weight_of_hit(&eye.eye, way, emitted, distance)
    }

    fn weight_of_connection<M>(
        &self,
        eye: &Self::Eye,
        vertex: &Vertex<'_, M>,
        lobes: (&SeenBsdf, &BsdfEval),
        light: &ChosenLight,
        hit_pdf: f32,
    ) -> Option<SharedConnection> {
        let hit_pdf = match eye.stage {
            Stage::LookedUp(_) => lobes.0.eval(light.sample.wi).pdf,
            _ => hit_pdf,
        };
        let eye = &eye.eye;
        self.merge
            .weight_of_connection(eye, vertex, lobes, light, hit_pdf)
    }

    fn weight_of_mirrored<M>(
        &self,
        eye: &Self::Eye,
        vertex: &Vertex<'_, M>,
        mirror: &Mirror,
        light: Option<u32>,
    ) -> Option<f32> {
        self.merge
            .weight_of_mirrored(&eye.eye, vertex, mirror, light)
    }
}
