//! Vertices of camera paths that take the light of photons around them.

mod arriving;
mod caustics;
mod final_gather;
mod light_tracing;
mod rest;
mod source;
mod unmerged;

use kilauea_bsdf::{BsdfEval, Mirror, SeenBsdf};
use kilauea_math::Spectrum;

use super::guide::Knowledge;
use super::media::Media;
use super::path_sample::PathSample;
use super::question::{Answer, Question};
use super::walk::{Path, Segment, Vertex};
use crate::light::{ChosenLight, Emitted};
use crate::sampler::Sampler;

pub(crate) use arriving::{ArrivingPhoton, N_WORDS};
pub(crate) use caustics::CausticMerge;
pub(crate) use final_gather::FinalGather;
pub(crate) use light_tracing::{LightPdfs, LightTracing, MIN_PEAK, SeenVertex, SplatShares};
pub(crate) use rest::Rest;
pub(crate) use source::{Gathering, PhotonSource, PhotonsOfSet};
pub(crate) use unmerged::Unmerged;

/// What photons have a share in of a light toward which a ray is aimed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SharedConnection {
    /// What diffuse lobes scatter of it that is shared, the cosine included.
    pub(crate) diffuse: Spectrum,
    /// The same for all other lobes.
    pub(crate) specular: Spectrum,
    /// Weight of that.
    pub(crate) weight: f32,
}

/// How paths share what they find with photons (Georgiev et al. 2012, "Light Transport Simulation
/// with Vertex Connection and Merging").
pub(crate) trait Merge: Copy + Send + Sync {
    /// What a path keeps of its way, for weights.
    type Eye: Copy + Send;

    /// What a path keeps of a vertex while it waits for photons: for answers `R`, by what it knows of
    /// light there, `K`.
    type Asked<R, K>: Default;

    /// What a path keeps as it leaves the camera.
    fn start(&self) -> Self::Eye;

    /// Adds what photons bring to a sample of a pixel by themselves.
    #[inline(always)]
    fn show(&self, _pixel: [i32; 2], _sample_idx: u32, _out: &mut PathSample) {}

    /// Looks up what diffuse lobes scatter at a vertex, where that is known beforehand, before anything
    /// else is asked there. A shader asks for direct and for indirect light of the same lobes, of which
    /// it is known whether they show a glint.
    #[inline(always)]
    fn look_up<M: Media>(
        &self,
        _path: &mut Path<M, Self::Eye>,
        _vertex: &Vertex<'_, M>,
        _lobes: (&SeenBsdf, bool),
        _sampler: &Sampler<'_>,
    ) {
    }

    /// By which lobes of the vertex light is still looked for.
    #[inline(always)]
    fn rest(_eye: &Self::Eye) -> Rest {
        Rest::All
    }

    /// Takes the light of photons at a vertex of these lobes, where the path chooses its direction by
    /// what it knows, or asks for it; whether there may be any.
    fn gather<M, R, K: Knowledge>(
        &self,
        eye: &mut Self::Eye,
        vertex: &Vertex<'_, M>,
        lobes: (&SeenBsdf, &K),
        ask: impl FnOnce(Question) -> R,
        asked: &mut Self::Asked<R, K>,
    ) -> bool;

    /// Waits for the light that was asked for, if any was.
    fn receive<R, K: Knowledge>(
        &self,
        eye: &mut Self::Eye,
        asked: &mut Self::Asked<R, K>,
    ) -> impl Future<Output = ()>
    where
        R: Future<Output = Answer> + Unpin;

    /// Hands over what was gathered: light scattered by diffuse lobes, and by all others.
    fn take(eye: &mut Self::Eye) -> Option<[Spectrum; 2]>;

    /// The path has left a vertex of these lobes, in a direction drawn from the second ones. Returns what
    /// it carries on of what diffuse lobes scattered, and of what others did.
    fn depart<M>(
        &self,
        eye: &mut Self::Eye,
        way: Segment<'_>,
        vertex: &Vertex<'_, M>,
        lobes: [&SeenBsdf; 2],
        sampler: &Sampler<'_>,
    ) -> [Spectrum; 2];

    /// Weight of light that the path meets at a distance on its way; none where photons have no share in
    /// it.
    fn weight_of_hit(
        &self,
        eye: &Self::Eye,
        way: Option<Segment<'_>>,
        emitted: &Emitted,
        distance: f32,
    ) -> Option<f32>;

    /// What photons have a share in of the light toward which a ray is aimed from a vertex of these lobes, which
    /// scatter `eval` of it, in a direction that the path chooses with the density `hit_pdf`.
    fn weight_of_connection<M>(
        &self,
        eye: &Self::Eye,
        vertex: &Vertex<'_, M>,
        lobes: (&SeenBsdf, &BsdfEval),
        light: &ChosenLight,
        hit_pdf: f32,
    ) -> Option<SharedConnection>;

    /// Weight of light from infinity, of the light of a number, toward which a ray is aimed by a mirror
    /// of a vertex, in place of that which the path draws; none where photons have no share in it.
    fn weight_of_mirrored<M>(
        &self,
        eye: &Self::Eye,
        vertex: &Vertex<'_, M>,
        mirror: &Mirror,
        light: Option<u32>,
    ) -> Option<f32>;
}
