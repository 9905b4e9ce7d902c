use std::time::Instant;

use kilauea_film::Filter;
use kilauea_gather::GatherRecord;
use kilauea_photon::Photon;
use kilauea_scene::{DataWindow, Shading};

use super::counts::PhotonCounts;
use super::tracer::{LeftPhotons, PhotonTracer};
use crate::RenderError;
use crate::caustics::Splat;
use crate::follow::{PATHS_PER_BLOCK, Workforce, follow_some};
use crate::integrator::{Air, Blame, Media, MediumStack, RayCone, RayTracer, SplatShares};
use crate::light::{Emitter, UsefulRay};
use crate::prepared::PreparedScene;
use crate::sampler::SamplerTables;
use crate::share::{PathKind, PathPass, PathShare, follow_shared};

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

/// Which photons are kept. Paths end where they can leave no more of them.
#[derive(Clone, Copy)]
pub(super) enum Kept<'a> {
    All,
    Caustic,
    /// What diffuse lobes receive, where there are any; of scouts, also how their light left.
    Irradiance {
        scouts: bool,
    },
    /// None, but how light arrives over mirrors, refraction and narrow lobes alone.
    Arrivals,
    /// None, but what the camera sees of light that was scattered in a peak first.
    Splats(&'a SplatView<'a>),
}

/// What the camera sees of photons.
#[derive(Clone, Copy)]
pub(crate) struct SplatView<'a> {
    pub(crate) shares: SplatShares<'a>,
    pub(crate) filter: &'a Filter,
    /// Pixels that there are.
    pub(crate) window: DataWindow,
    /// Of camera rays.
    pub(crate) cone: RayCone,
    /// Whether it is to be told how the light left of photons that are seen.
    pub(crate) scouts: bool,
}

impl Kept<'_> {
    fn path_kind(self) -> PathKind {
        match self {
            Self::All => PathKind::Photons,
            Self::Caustic => PathKind::CausticPhotons,
            Self::Irradiance { .. } => PathKind::Irradiance,
            Self::Arrivals => PathKind::Arrivals,
            Self::Splats(_) => PathKind::Splats,
        }
    }
}

/// Photons of a scene.
#[derive(Clone, Debug, Default)]
pub struct TracedPhotons {
    /// In the order of their paths; of one path, in the order of its surfaces.
    pub photons: Vec<Photon>,
    /// Greatest channel of a valid photon's power, also of those that others keep.
    pub brightest: f32,
    /// What was done for them.
    pub counts: PhotonCounts,
    /// How long that took.
    pub seconds: f64,
    /// How the light left of the caustic ones where all were kept, or of each scout.
    pub(crate) useful_rays: Vec<UsefulRay>,
}

/// How light arrives over mirrors, refraction and narrow lobes alone.
#[derive(Default)]
pub(crate) struct TracedArrivals {
    /// In the order of their paths.
    pub(crate) arrivals: Vec<GatherRecord>,
    /// How their light left.
    pub(crate) rays: Vec<UsefulRay>,
    /// Luminance of the power that lights sent out, in watts.
    pub(crate) sent_out: f64,
    pub(crate) counts: PhotonCounts,
}

/// Traces the photons of a scene. Their powers are divided by the number of paths emitted.
///
/// Light of which photons have none: that of emissive meshes that move, of emissive curves and
/// points, which no ray is aimed at either, and channels in which a light is less than black.
///
/// # Errors
/// If a shader panics.
pub fn trace_photons(
    prepared: &PreparedScene,
    request: &PhotonRequest,
) -> Result<TracedPhotons, RenderError> {
    trace_photons_shared(prepared, request, None)
}

/// Like [`trace_photons`], together with those who trace the same ones.
pub(crate) fn trace_photons_shared(
    prepared: &PreparedScene,
    request: &PhotonRequest,
    share: Option<&dyn PathShare>,
) -> Result<TracedPhotons, RenderError> {
    let emitter = Emitter::new(&prepared.lights, &prepared.geometry, &prepared.textures);
    trace_kept(prepared, &emitter, request, Kept::All, share)
}

/// Traces those photons alone that come over specular surfaces alone, from lights that may be aimed:
/// others are left out.
pub(crate) fn trace_caustic_photons(
    prepared: &PreparedScene,
    emitter: &Emitter<'_>,
    request: &PhotonRequest,
    share: Option<&dyn PathShare>,
) -> Result<TracedPhotons, RenderError> {
    trace_kept(prepared, emitter, request, Kept::Caustic, share)
}

/// What the camera sees of photons, and what was done for that.
#[derive(Default)]
pub(crate) struct TracedSplats {
    /// In the order of their paths.
    pub(crate) splats: Vec<Splat>,
    /// How the light of each left, where that is asked for, with the luminance that a pixel gets.
    pub(crate) rays: Vec<UsefulRay>,
    pub(crate) counts: PhotonCounts,
}

/// Traces what the camera sees of light that was scattered in a peak first, from lights that may be aimed.
pub(crate) fn trace_splats(
    prepared: &PreparedScene,
    emitter: &Emitter<'_>,
    view: &SplatView<'_>,
    request: &PhotonRequest,
    share: Option<&dyn PathShare>,
) -> Result<TracedSplats, RenderError> {
    let mut traced = TracedSplats::default();
    for left in follow_photons(prepared, emitter, request, Kept::Splats(view), share)? {
        traced.counts.add(&left.counts);
        traced.splats.extend(left.splats);
        traced.rays.extend(left.useful_rays);
    }
    Ok(traced)
}

/// Traces photons whose density is what diffuse lobes receive: each counts for as much as its surface
/// takes of light from there, so that irradiance times [`kilauea_bsdf::SeenBsdf::diffuse_albedo`] / π is
/// the radiance that diffuse lobes send on.
pub(crate) fn trace_irradiance(
    prepared: &PreparedScene,
    emitter: &Emitter<'_>,
    request: &PhotonRequest,
    share: Option<&dyn PathShare>,
) -> Result<TracedPhotons, RenderError> {
    let kept = Kept::Irradiance { scouts: false };
    trace_kept(prepared, emitter, request, kept, share)
}

/// As [`trace_irradiance`], with how the light of each photon left.
pub(crate) fn trace_scouts(
    prepared: &PreparedScene,
    emitter: &Emitter<'_>,
    request: &PhotonRequest,
    share: Option<&dyn PathShare>,
) -> Result<TracedPhotons, RenderError> {
    let kept = Kept::Irradiance { scouts: true };
    trace_kept(prepared, emitter, request, kept, share)
}

/// Traces how light arrives where paths can be aimed at it, from lights that may be aimed
/// themselves.
pub(crate) fn trace_arrivals(
    prepared: &PreparedScene,
    emitter: &Emitter<'_>,
    request: &PhotonRequest,
    share: Option<&dyn PathShare>,
) -> Result<TracedArrivals, RenderError> {
    let mut traced = TracedArrivals::default();
    for left in follow_photons(prepared, emitter, request, Kept::Arrivals, share)? {
        traced.counts.add(&left.counts);
        traced.arrivals.extend(left.arrivals);
        traced.rays.extend(left.useful_rays);
        traced.sent_out += left.sent_out;
    }
    Ok(traced)
}

fn trace_kept(
    prepared: &PreparedScene,
    emitter: &Emitter<'_>,
    request: &PhotonRequest,
    kept: Kept<'_>,
    share: Option<&dyn PathShare>,
) -> Result<TracedPhotons, RenderError> {
    let start = Instant::now();
    let left = follow_photons(prepared, emitter, request, kept, share)?;
    let mut traced = TracedPhotons::default();
    traced
        .photons
        .reserve_exact(left.iter().map(|l| l.photons.len()).sum());
    for left in left {
        traced.counts.add(&left.counts);
        traced.photons.extend(left.photons);
        traced.brightest = traced.brightest.max(left.brightest);
        traced.useful_rays.extend(left.useful_rays);
    }
    traced.seconds = start.elapsed().as_secs_f64();
    Ok(traced)
}

/// What all paths leave, in their order, some together.
fn follow_photons(
    prepared: &PreparedScene,
    emitter: &Emitter<'_>,
    request: &PhotonRequest,
    kept: Kept<'_>,
    share: Option<&dyn PathShare>,
) -> Result<Vec<LeftPhotons>, RenderError> {
    let needs = &prepared.needs;
    match (needs.media, needs.cutouts || needs.nested_media) {
        (false, false) => follow::<false, Air>(prepared, emitter, request, kept, share),
        (false, true) => follow::<true, Air>(prepared, emitter, request, kept, share),
        (true, false) => follow::<false, MediumStack>(prepared, emitter, request, kept, share),
        (true, true) => follow::<true, MediumStack>(prepared, emitter, request, kept, share),
    }
}

fn follow<const CUTOUTS: bool, M: Media>(
    prepared: &PreparedScene,
    emitter: &Emitter<'_>,
    request: &PhotonRequest,
    kept: Kept<'_>,
    share: Option<&dyn PathShare>,
) -> Result<Vec<LeftPhotons>, RenderError> {
    /// Keeps the numbers of photons apart from those of camera paths.
    const PHOTON_SEED: u32 = 0x5bf0_3635;
    let &PhotonRequest {
        n_emitted,
        max_depth,
        seed,
        n_threads,
        shading,
    } = request;
    if emitter.is_empty() || n_emitted == 0 {
        return Ok(Vec::new());
    }
    let blame = Blame::default();
    let tables = SamplerTables::new(n_emitted, max_depth, seed ^ PHOTON_SEED);
    let tracer = PhotonTracer::<CUTOUTS, M>::new(emitter, prepared, &blame, request, kept, &tables);
    let answerer = RayTracer::<CUTOUTS>::of(prepared, &blame);
    let workforce = Workforce { n_threads, shading };
    let follow = |paths| follow_some(&tracer, paths, &answerer, workforce).map(in_blocks);
    let pass = PathPass {
        kind: kept.path_kind(),
        seed,
        n_paths: n_emitted,
    };
    follow_shared(share, pass, follow)
        .map_err(|error| RenderError::of_run(error, &blame, &prepared.geometry))
}

/// What paths left, in blocks of as many paths each, however they were followed: sums of floats are the
/// same then.
fn in_blocks(left: Vec<LeftPhotons>) -> Vec<LeftPhotons> {
    let mut blocks: Vec<LeftPhotons> = Vec::new();
    for left in left {
        match blocks.last_mut() {
            Some(block)
                if block.counts.emitted + left.counts.emitted <= u64::from(PATHS_PER_BLOCK) =>
            {
                block.append(left);
            }
            _ => blocks.push(left),
        }
    }
    blocks
}
