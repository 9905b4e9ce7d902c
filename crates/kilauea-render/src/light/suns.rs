//! Where small bright lights are around the scene.

use kilauea_math::Vec2;
use kilauea_math::Vec3;
use kilauea_math::hash::{combine, unit_f32};
use kilauea_texture::TextureStore;
use std::f32::consts::PI;

use super::InfiniteLight;

/// What is so many times as bright as white surfaces under all of these lights makes glints.
const LEAST_CONTRAST: f32 = 100.0;
/// Directions that are drawn of each light.
const N_DIRECTIONS: u32 = 64;

/// Directions toward the bright parts of lights around the scene; none where there are none.
pub(super) fn suns(lights: &[InfiniteLight], textures: &TextureStore) -> Vec<Vec3> {
    let irradiance = |light: &InfiniteLight| match light {
        InfiniteLight::Distant(light) => light.irradiance().max_channel(),
        InfiniteLight::Dome(light) => PI * light.mean_radiance().max_channel(),
    };
    let white = lights.iter().map(irradiance).sum::<f32>() / PI;
    let drawn = lights.iter().flat_map(|light| {
        (0..N_DIRECTIONS).filter_map(move |i| {
            let u = Vec2::new(unit_f32(combine(i, 0)), unit_f32(combine(i, 1)));
            match light {
                InfiniteLight::Distant(light) if light.is_delta() => None,
                InfiniteLight::Distant(light) => Some(light.sample(u)),
                InfiniteLight::Dome(light) => light.sample_emission(u, textures),
            }
        })
    });
    let bright = drawn.filter(|sample| sample.radiance.max_channel() > LEAST_CONTRAST * white);
    bright.map(|sample| sample.wi).collect()
}
