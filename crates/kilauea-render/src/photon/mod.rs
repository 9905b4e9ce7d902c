//! Photons from lights through the scene (Jensen 1996, "Global Illumination using Photon Maps").
//!
//! An [`Emitter`](crate::light) sends them out, a [`PhotonTracer`] follows them from surface to
//! surface, and each surface with a lobe rough enough to be looked at from anywhere keeps one. Paths
//! are SPOTs of the same engine as camera paths and ask the same [`Question`](crate::integrator)s;
//! their random numbers depend on seed and path alone, so that the photons are the same in any order
//! and with any number of threads.

mod counts;
mod horizons;
mod meeting;
mod path;
mod program;
mod scatter;
mod tracer;

use std::time::Instant;

use kilauea_photon::Photon;
use kilauea_scene::Shading;
use kilauea_spot::{Bytes, Engine, Queue, RunError};

use crate::RenderError;
use crate::integrator::{Air, Blame, Media, MediumStack, RayTracer};
use crate::light::Emitter;
use crate::needs::SceneNeeds;
use crate::prepared::PreparedScene;
use crate::sampler::SamplerTables;
pub use counts::PhotonCounts;
use program::{PhotonJob, PhotonProgram};
use tracer::PhotonTracer;

/// Roughness from which on a surface keeps photons, and below which scattering is specular for the
/// classes of photons: lobes that are narrower see too few photons of a map.
pub const MIN_ROUGHNESS: f32 = 0.05;

/// What to trace.
#[derive(Clone, Copy, Debug)]
pub struct PhotonRequest {
    /// Paths that leave lights.
    pub n_emitted: u32,
    /// Surfaces that a path meets at most.
    pub max_depth: u32,
    /// Makes other, equally good photons.
    pub seed: u32,
    /// Engine threads.
    pub n_threads: usize,
    /// How questions of paths are answered. The photons are the same.
    pub shading: Shading,
}

/// Photons of a scene.
#[derive(Clone, Debug, Default)]
pub struct TracedPhotons {
    /// In the order of their paths; of one path, in the order of its surfaces.
    pub photons: Vec<Photon>,
    /// What was done for them.
    pub counts: PhotonCounts,
    /// How long that took.
    pub seconds: f64,
}

/// Traces the photons of a scene. Their powers are divided by the number of paths emitted.
///
/// # Errors
/// If a shader panics.
pub fn trace_photons(
    prepared: &PreparedScene,
    request: &PhotonRequest,
) -> Result<TracedPhotons, RenderError> {
    let needs = prepared.needs;
    match (needs.media, needs.cutouts || needs.nested_media) {
        (false, false) => run::<false, Air>(prepared, request, needs),
        (false, true) => run::<true, Air>(prepared, request, needs),
        (true, false) => run::<false, MediumStack>(prepared, request, needs),
        (true, true) => run::<true, MediumStack>(prepared, request, needs),
    }
}

fn run<const CUTOUTS: bool, M: Media>(
    prepared: &PreparedScene,
    request: &PhotonRequest,
    needs: SceneNeeds,
) -> Result<TracedPhotons, RenderError> {
    /// Keeps the numbers of photons apart from those of camera paths.
    const PHOTON_SEED: u32 = 0x5bf0_3635;
    let start = Instant::now();
    let PreparedScene {
        geometry,
        lights,
        textures,
        ..
    } = prepared;
    let emitter = Emitter::new(lights, geometry, textures);
    if emitter.is_empty() || request.n_emitted == 0 {
        return Ok(TracedPhotons::default());
    }
    let blame = Blame::default();
    let tables = SamplerTables::new(
        request.n_emitted,
        request.max_depth,
        request.seed ^ PHOTON_SEED,
    );
    let program = PhotonProgram::<CUTOUTS, M> {
        tracer: PhotonTracer::new(&emitter, prepared, &blame, request, needs, &tables),
    };
    let answerer = RayTracer::<CUTOUTS> {
        geometry,
        textures,
        blame: &blame,
    };
    let engine = Engine::new(request.n_threads);
    let n_servers = request.n_threads;
    let per_root = match request.shading {
        Shading::Inline => 256,
        // While one path waits, others go on.
        Shading::Queued | Shading::Bytes => 1,
    };
    let job = PhotonJob::new(request.n_emitted, per_root);
    let result: Result<_, RunError> = match request.shading {
        Shading::Inline => engine.run_inline(&program, &answerer, &job),
        Shading::Queued => engine.run_queued(&program, &Queue::new(&answerer), n_servers, &job),
        Shading::Bytes => engine.run_queued(&program, &Bytes::new(&answerer), n_servers, &job),
    };
    if let Err(error) = result {
        return Err(RenderError::of_run(error, &blame));
    }
    let (photons, counts) = job.into_photons();
    Ok(TracedPhotons {
        photons,
        counts,
        seconds: start.elapsed().as_secs_f64(),
    })
}
