//! Glints: bright spots among the lights at infinity, as mirrors show them.
//!
//! Lobes are drawn, and paths are ended, by what they scatter of even light. A clear coat then shows
//! the sun in one path of twenty, and dim paths that meet it weigh much: fireflies. Where a mirror
//! looks at a bright spot is known before any ray is traced: a ray is aimed there beside the path.

use kilauea_bsdf::{Bsdf, Mirror, SeenBsdf};
use kilauea_math::{Spectrum, Vec3};
use kilauea_texture::TextureStore;

use super::{Emitter, InfiniteLight, Lights};

/// A spot is bright that is so many times brighter than light from infinity on average.
pub(super) const MIN_CONTRAST: f32 = 8.0;
/// Mirrors that paths draw more often need no other ray.
const MAX_PROBABILITY: f32 = 0.9;

/// How bright the lights at infinity are, in luminance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Brightness {
    /// What a diffuse surface shows of all that faces it, over its albedo.
    even: f32,
    has_spots: bool,
}

impl Brightness {
    pub(super) fn of(lights: &[InfiniteLight]) -> Self {
        let even = lights.iter().map(InfiniteLight::even_radiance).sum();
        let has_spots = lights.iter().any(|light| match light {
            InfiniteLight::Distant(l) if l.is_delta() => false,
            InfiniteLight::Distant(l) => l.radiance().luminance() > MIN_CONTRAST * even,
            InfiniteLight::Dome(l) => l.has_spots(),
        });
        Self { even, has_spots }
    }
}

impl Lights {
    /// Whether there are bright spots at infinity.
    pub(crate) fn have_bright_spots(&self) -> bool {
        self.brightness.has_spots
    }

    /// The mirror of these lobes, if it shows a bright spot that paths would seldom find.
    #[inline]
    pub(crate) fn glint(&self, seen: &SeenBsdf, textures: &TextureStore) -> Option<Mirror> {
        let is_glint = |mirror: &Mirror| {
            mirror.probability < MAX_PROBABILITY
                && self.contrast(mirror.wi, textures) > MIN_CONTRAST
        };
        seen.mirror().filter(is_glint)
    }

    /// How many times brighter than on average it is in a unit direction, if that makes it a bright
    /// spot; one elsewhere.
    pub(crate) fn spot_contrast(&self, dir: Vec3, textures: &TextureStore) -> f32 {
        let contrast = self.contrast(dir, textures);
        if contrast > MIN_CONTRAST {
            contrast
        } else {
            1.0
        }
    }

    fn contrast(&self, dir: Vec3, textures: &TextureStore) -> f32 {
        let radiance = self.infinite.iter().filter_map(|light| match light {
            InfiniteLight::Distant(l) => l.radiance_and_pdf(dir).map(|(radiance, _)| radiance),
            InfiniteLight::Dome(l) if l.may_have_spot(dir) => Some(l.radiance_from(dir, textures)),
            InfiniteLight::Dome(_) => None,
        });
        radiance.map(Spectrum::luminance).sum::<f32>() / self.brightness.even
    }
}

impl Emitter<'_> {
    /// Whether camera paths that come along `wo` see a glint.
    pub(crate) fn is_glint(&self, bsdf: &Bsdf, wo: Vec3) -> bool {
        let has_spots = self.lights.brightness.has_spots;
        has_spots
            && self
                .lights
                .glint(&bsdf.seen_from(wo), self.textures)
                .is_some()
    }
}

impl InfiniteLight {
    fn even_radiance(&self) -> f32 {
        match self {
            Self::Distant(l) => std::f32::consts::FRAC_1_PI * l.irradiance().luminance(),
            Self::Dome(l) => l.mean_radiance().luminance(),
        }
    }
}
