//! How likely photons leave lights along a given ray.

use kilauea_math::Vec3;

use super::aim::Target;
use super::mesh_emission::cosine_to_either_side_pdf;
use super::{Emitter, InfiniteLight};

impl Emitter<'_> {
    /// Density with which [`Emitter::emit`] chooses a light, by number, and a ray of it along the
    /// unit vector `dir` through `p`: as [`EmittedPhoton::density`](super::EmittedPhoton::density).
    ///
    /// Whether the ray is one of that light's is for the caller to know.
    pub(crate) fn density(&self, light: u32, p: Vec3, dir: Vec3) -> f32 {
        let probability = self.choice.probability(light);
        if probability == 0.0 {
            return 0.0;
        }
        let lights = self.lights;
        let n_finite = lights.area.len() + lights.mesh.len();
        let target = self.target(light);
        let of_light = if let Some(area) = lights.area.get(light as usize) {
            let pdf = target.direction_pdf(dir, area.emission_cone().pdf(dir));
            area.cross_section(dir).map_or(0.0, |section| pdf / section)
        } else if let Some(idx) = (light as usize).checked_sub(n_finite) {
            self.density_from_infinity(&lights.infinite[idx], dir)
                * self.density_of_entry(target, p, dir)
        } else {
            let [a, b, c] = lights.mesh.corners(light, self.geometry);
            let area_vector = 0.5 * (b - a).cross(c - a);
            let pdf = cosine_to_either_side_pdf(area_vector.normalize_or_zero(), dir);
            let cross_section = area_vector.dot(dir).abs();
            if cross_section > 0.0 {
                target.direction_pdf(dir, pdf) / cross_section
            } else {
                0.0
            }
        };
        probability * of_light
    }

    fn density_of_entry(&self, target: &Target, p: Vec3, dir: Vec3) -> f32 {
        let lit = self.lit.as_ref();
        lit.map_or(0.0, |lit| target.density_per_area(lit, p, dir))
    }

    fn density_from_infinity(&self, light: &InfiniteLight, dir: Vec3) -> f32 {
        match light {
            InfiniteLight::Distant(l) if l.is_delta() => 1.0,
            InfiniteLight::Distant(l) => l.radiance_and_pdf(-dir).map_or(0.0, |(_, pdf)| pdf),
            InfiniteLight::Dome(l) => l.emission_pdf(-dir, self.textures),
        }
    }
}
