//! Whether photons pay: what they would bring to the image, found by a few of them.

use std::f64::consts::PI;
use std::num::NonZeroUsize;

use kilauea_math::Spectrum;
use kilauea_photon::{DensityRule, Photon, PhotonClass, PhotonMap, RadiusRule, SurfaceQuery};
use serde::Serialize;

use super::importon::{Importon, ImportonRequest, trace_importons};
use super::trace::{PhotonRequest, TracedPhotons, trace_photons_shared};
use crate::RenderError;
use crate::prepared::PreparedScene;
use crate::share::PathShare;

/// Paths of light that are enough to tell.
pub(crate) const N_PILOT: u32 = 1 << 15;
/// Pixels along the side of the square that an importon stands for.
pub(crate) const IMPORTON_BLOCK: u32 = 4;
/// Photons that an estimate takes.
const N_NEAREST: NonZeroUsize = NonZeroUsize::new(32).expect("not zero");
/// Least share of the light of an image that is worth a map of global photons.
const MIN_INDIRECT_SHARE: f64 = 0.05;

/// Of the light that the first rough surfaces send to the camera, how much came over what.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct LightShares {
    /// Straight from a light.
    pub direct: f64,
    /// Over specular surfaces alone.
    pub caustic: f64,
    /// Over any others.
    pub indirect: f64,
}

/// Whether photons of each class are worth their time, and why.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PhotonBenefit {
    /// What the image would get of them.
    pub shares: LightShares,
    /// Photons of this class are worth it.
    pub caustic: bool,
    /// Photons of this class are worth it.
    pub global: bool,
    /// For each class that is not, in words with figures.
    pub skipped: Vec<String>,
}

/// What a few paths from either end found.
pub(crate) struct Pilot {
    /// The first rough surfaces that are seen.
    pub(crate) importons: Vec<Importon>,
    pub(crate) traced: TracedPhotons,
    pub(crate) benefit: PhotonBenefit,
    /// Squares of pixels that paths left the camera for.
    pub(crate) n_blocks: f64,
    /// Luminance that a pixel gets from rough surfaces, in the mean.
    pub(crate) mean_luminance: f64,
}

/// Estimates what photons would bring to an image of so many pixels.
///
/// # Errors
/// If a shader panics.
pub fn photon_benefit(
    prepared: &PreparedScene,
    resolution: [u32; 2],
    request: &PhotonRequest,
) -> Result<PhotonBenefit, RenderError> {
    pilot(prepared, resolution, request, None).map(|pilot| pilot.benefit)
}

/// As [`photon_benefit`], with what it is from; together with those who ask the same.
pub(crate) fn pilot(
    prepared: &PreparedScene,
    resolution: [u32; 2],
    request: &PhotonRequest,
    share: Option<&dyn PathShare>,
) -> Result<Pilot, RenderError> {
    let importons = trace_importons(
        prepared,
        &ImportonRequest {
            resolution,
            block: IMPORTON_BLOCK,
            max_depth: request.max_depth,
            max_rough: 1,
            seed: request.seed,
            n_threads: request.n_threads,
        },
    )?;
    let pilot = PhotonRequest {
        n_emitted: N_PILOT.min(request.n_emitted),
        ..*request
    };
    let traced = trace_photons_shared(prepared, &pilot, share)?;
    let (shares, sum) = LightShares::and_sum_at(&importons, &traced.photons);
    let n_blocks: f64 = (resolution.iter())
        .map(|&n| f64::from(n.div_ceil(IMPORTON_BLOCK)))
        .product();
    Ok(Pilot {
        importons,
        traced,
        benefit: PhotonBenefit::of(shares),
        n_blocks,
        mean_luminance: sum / (PI * n_blocks),
    })
}

impl LightShares {
    /// Of the light that photons bring to importons.
    pub fn at(importons: &[Importon], photons: &[Photon]) -> Self {
        Self::and_sum_at(importons, photons).0
    }

    /// The same, with the sum of what they scatter to the camera, times π.
    fn and_sum_at(importons: &[Importon], photons: &[Photon]) -> (Self, f64) {
        let [direct, caustic, indirect] =
            [Kind::Direct, Kind::Caustic, Kind::Indirect].map(|kind| {
                let of_kind = photons.iter().filter(|photon| Kind::of(photon) == kind);
                let map = PhotonMap::build(&of_kind.copied().collect::<Vec<_>>());
                scattered_to_camera(importons, &map)
            });
        let total = direct + caustic + indirect;
        let share = |part: f64| if total > 0.0 { part / total } else { 0.0 };
        let shares = Self {
            direct: share(direct),
            caustic: share(caustic),
            indirect: share(indirect),
        };
        (shares, total)
    }
}

/// What a photon has seen before.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Direct,
    Caustic,
    Indirect,
}

impl Kind {
    fn of(photon: &Photon) -> Self {
        match photon.class {
            PhotonClass::Caustic { .. } => Self::Caustic,
            PhotonClass::Global if photon.depth == 0 => Self::Direct,
            PhotonClass::Global => Self::Indirect,
        }
    }
}

/// Luminance that the camera gets of a map's photons.
fn scattered_to_camera(importons: &[Importon], map: &PhotonMap) -> f64 {
    let radius = RadiusRule::Nearest {
        k: N_NEAREST,
        max_radius: f32::INFINITY,
    };
    let rule = DensityRule::default();
    let of_importon = |importon: &Importon| {
        let query = SurfaceQuery {
            p: importon.p,
            n: importon.n,
        };
        let irradiance: Spectrum = map.irradiance_by(&query, radius, &rule).value;
        f64::from((importon.throughput * importon.albedo * irradiance).luminance())
    };
    importons.iter().map(of_importon).sum()
}

impl PhotonBenefit {
    fn of(shares: LightShares) -> Self {
        // However little it is, paths find it as fireflies.
        let caustic = shares.caustic > 0.0;
        let global = shares.indirect >= MIN_INDIRECT_SHARE;
        let mut skipped = Vec::new();
        if !caustic {
            skipped.push("caustic photons: none arrive where they are seen".into());
        }
        if !global {
            skipped.push(format!(
                "global photons: they bring {:.2} % of the light, less than {:.1} %",
                100.0 * shares.indirect,
                100.0 * MIN_INDIRECT_SHARE
            ));
        }
        Self {
            shares,
            caustic,
            global,
            skipped,
        }
    }
}
