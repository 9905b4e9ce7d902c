//! What a light emits in each direction.

use kilauea_math::{Spectrum, Vec2, Vec3};
use kilauea_scene::{Light, Wrap};
use kilauea_texture::TextureStore;

/// Radiance, texture and shaping of a light.
#[derive(Clone, Debug)]
pub(super) struct Emission {
    /// Radiance before texture and shaping.
    pub radiance: Spectrum,
    /// Multiplies what diffuse lobes reflect.
    pub diffuse: f32,
    /// Multiplies what specular lobes reflect.
    pub specular: f32,
    texture: Option<u32>,
    shaping: Option<ConeShaping>,
}

/// UsdLuxShapingAPI in engine space.
#[derive(Clone, Debug)]
struct ConeShaping {
    axis: Vec3,
    cone_angle: f32,
    smooth_start: f32,
    focus: f32,
    focus_tint: Spectrum,
}

impl Emission {
    pub(super) fn new(light: &Light) -> Self {
        let axis = light
            .world_from_light
            .transform_vector3(kilauea_math::DVec3::NEG_Z)
            .as_vec3();
        Self {
            radiance: light.radiance,
            diffuse: light.diffuse,
            specular: light.specular,
            texture: light.texture,
            shaping: light.shaping.as_ref().map(|s| {
                let cone_angle = s.cone_angle_degrees.to_radians();
                ConeShaping {
                    axis: axis.normalize_or(Vec3::NEG_Z),
                    cone_angle,
                    smooth_start: cone_angle * (1.0 - s.cone_softness),
                    focus: s.focus,
                    focus_tint: s.focus_tint,
                }
            }),
        }
    }

    /// Radiance that leaves in the unit direction `toward`, from the point with coordinates `st`.
    pub(super) fn radiance(&self, toward: Vec3, st: Vec2, textures: &TextureStore) -> Spectrum {
        let mut radiance = self.radiance;
        if let Some(texture) = self.texture {
            let texel = textures.sample(texture, st, 0.0, [Wrap::Clamp; 2]);
            radiance *= texel.map_or(Spectrum::BLACK, |[r, g, b, _]| Spectrum::new(r, g, b));
        }
        match &self.shaping {
            None => radiance,
            Some(shaping) => radiance * shaping.factor(toward),
        }
    }

    /// Where shaping confines the light to: the unit axis, and the greatest angle to it in radians.
    pub(super) fn cone(&self) -> Option<(Vec3, f32)> {
        let shaping = self.shaping.as_ref()?;
        Some((shaping.axis, shaping.cone_angle))
    }

    /// What shaping leaves of the radiance in the unit direction `toward`.
    pub(super) fn shape_factor(&self, toward: Vec3) -> Spectrum {
        let shaping = self.shaping.as_ref();
        shaping.map_or(Spectrum::ONE, |shaping| shaping.factor(toward))
    }

    /// Mean radiance over the surface, for choosing among lights.
    pub(super) fn mean_radiance(&self, textures: &TextureStore) -> Spectrum {
        match self.texture {
            None => self.radiance,
            Some(texture) => self.radiance * mean_texel(texture, textures),
        }
    }
}

impl ConeShaping {
    /// Formulas of the UsdLux schema and hdEmbree.
    fn factor(&self, toward: Vec3) -> Spectrum {
        let cos = toward.dot(self.axis).clamp(-1.0, 1.0);
        let theta = cos.acos();
        let fade = if theta > self.cone_angle {
            0.0
        } else if theta > self.smooth_start {
            let x = (theta - self.smooth_start) / (self.cone_angle - self.smooth_start);
            1.0 - x * x * (3.0 - 2.0 * x)
        } else {
            1.0
        };
        let focused = cos.abs().powf(self.focus);
        let tint = Spectrum::splat(focused) * (Spectrum::ONE - self.focus_tint) + self.focus_tint;
        tint * fade
    }
}

/// Mean of an image, from its coarsest mip level; black where it is missing.
fn mean_texel(texture: u32, textures: &TextureStore) -> Spectrum {
    let coarsest = textures
        .n_levels(texture)
        .and_then(|n| textures.read_level(texture, n - 1));
    let Some(level) = coarsest else {
        return Spectrum::BLACK;
    };
    let sum: Spectrum = level
        .texels
        .iter()
        .map(|&[r, g, b, _]| Spectrum::new(r, g, b))
        .sum();
    sum / level.texels.len() as f32
}
