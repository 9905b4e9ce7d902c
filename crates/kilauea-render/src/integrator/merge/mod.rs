//! Vertices of camera paths that take the light of photons around them.

mod caustics;
mod unmerged;

use kilauea_bsdf::SeenBsdf;
use kilauea_math::Spectrum;

use super::guide::Knowledge;
use super::walk::{Path, Vertex};
use crate::light::{ChosenLight, Emitted};

pub(crate) use caustics::CausticMerge;
pub(crate) use unmerged::Unmerged;

/// How paths share what they find with photons (Georgiev et al. 2012, "Light Transport Simulation
/// with Vertex Connection and Merging").
pub(crate) trait Merge: Copy + Send + Sync {
    /// What a path keeps of its way, for weights.
    type Eye: Copy + Send;

    /// What a path keeps as it leaves the camera.
    fn start(&self) -> Self::Eye;

    /// Takes the light of photons at a vertex, where the path chooses its direction by `knowledge`;
    /// whether there is any.
    fn gather<M>(
        &self,
        eye: &mut Self::Eye,
        vertex: &Vertex<'_, M>,
        bsdf: &SeenBsdf,
        knowledge: &impl Knowledge,
    ) -> bool;

    /// Hands over what was gathered: light scattered by diffuse lobes, and by all others.
    fn take(eye: &mut Self::Eye) -> Option<[Spectrum; 2]>;

    /// The path has left a vertex on its ray.
    fn depart<M>(&self, path: &mut Path<M, Self::Eye>, vertex: &Vertex<'_, M>, bsdf: &SeenBsdf);

    /// Weight of light that the path's ray meets; none where photons have no share in it.
    fn weight_of_hit<M>(&self, path: &Path<M, Self::Eye>, emitted: &Emitted) -> Option<f32>;

    /// Weight of light toward which a ray is aimed from a vertex, in a direction that the path chooses
    /// with the density `hit_pdf`; none where photons have no share in it.
    fn weight_of_connection<M>(
        &self,
        eye: &Self::Eye,
        vertex: &Vertex<'_, M>,
        bsdf: &SeenBsdf,
        light: &ChosenLight,
        hit_pdf: f32,
    ) -> Option<f32>;
}
