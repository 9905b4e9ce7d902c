//! How likely photons leave lights along a given ray.

use kilauea_math::Vec3;
use std::f32::consts::PI;

use super::{Emitter, InfiniteLight};

impl Emitter<'_> {
    /// Density with which [`Emitter::emit`] chooses a light, by number, and a ray of it along the
    /// unit vector `dir`: as [`EmittedPhoton::density`](super::EmittedPhoton::density).
    ///
    /// Whether the ray is one of that light's is for the caller to know.
    pub(crate) fn density(&self, light: u32, dir: Vec3) -> f32 {
        let probability = self.choice.probability(light);
        if probability == 0.0 {
            return 0.0;
        }
        let lights = self.lights;
        let n_finite = lights.area.len() + lights.mesh.len();
        let of_light = if let Some(area) = lights.area.get(light as usize) {
            let pdf = area.emission_cone().pdf(dir);
            area.cross_section(dir).map_or(0.0, |section| pdf / section)
        } else if let Some(idx) = (light as usize).checked_sub(n_finite) {
            self.density_from_infinity(&lights.infinite[idx], dir)
        } else {
            // A cosine to either side, over the shadow of the triangle: the cosines cancel.
            let [a, b, c] = lights.mesh.corners(light, self.geometry);
            0.5 / (PI * 0.5 * (b - a).cross(c - a).length())
        };
        probability * of_light
    }

    fn density_from_infinity(&self, light: &InfiniteLight, dir: Vec3) -> f32 {
        let Some(lit) = &self.lit else { return 0.0 };
        let pdf = match light {
            InfiniteLight::Distant(l) if l.is_delta() => 1.0,
            InfiniteLight::Distant(l) => l.radiance_and_pdf(-dir).map_or(0.0, |(_, pdf)| pdf),
            InfiniteLight::Dome(l) => l.emission_pdf(-dir, self.textures),
        };
        pdf / lit.cross_section(dir)
    }
}
