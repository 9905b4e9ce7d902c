use kilauea_accel::Ray;
use kilauea_math::Vec3;
use kilauea_texture::TextureStore;

use super::{ByImportance, InfiniteLight, Lights, Receiver};
use crate::geometry::Geometry;

impl Lights {
    /// Density per solid angle with which a light, by number, is chosen by importance at a receiver, and
    /// the unit direction `wi` to the point of it that is `distance` away; for parallel light the
    /// probability of choosing it.
    pub(super) fn connection_pdf(
        &self,
        light: u32,
        receiver: Receiver,
        wi: Vec3,
        distance: f32,
        geometry: &Geometry,
        textures: &TextureStore,
    ) -> f32 {
        let n_finite = self.area.len() + self.mesh.len();
        let pdf = match (light as usize).checked_sub(n_finite) {
            Some(idx) => match &self.infinite[idx] {
                InfiniteLight::Distant(l) if l.is_delta() => 1.0,
                InfiniteLight::Distant(l) => l.radiance_and_pdf(wi).map_or(0.0, |(_, pdf)| pdf),
                InfiniteLight::Dome(l) => l.radiance_and_pdf(Some(receiver.n), wi, textures).1,
            },
            None => match self.area.get(light as usize) {
                Some(area) => area
                    .intersect(&Ray::new(receiver.p, wi))
                    .map_or(0.0, |hit| area.pdf(receiver.p, wi, &hit)),
                None => self.mesh.pdf(
                    light,
                    &self.mesh.corners(light, geometry),
                    receiver.p,
                    -wi,
                    distance,
                ),
            },
        };
        pdf * self.probability(light, receiver, ByImportance)
    }
}
