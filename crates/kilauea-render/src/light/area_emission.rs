//! Photons of area lights: a direction first, then a point of the light's cross-section.

use kilauea_math::{Frame, Spectrum, Vec2, Vec3, warp};
use kilauea_texture::TextureStore;
use std::f32::consts::{FRAC_PI_2, PI};

use super::area::{AreaLight, UnitShape};
use super::emission_cone::EmissionCone;
use super::emit::LightRay;

/// Of directions over which the flux of a shaped light is summed, along each coordinate.
const N_FLUX: u32 = 24;
/// What covers a light, closer than this part of its size, does not hold its photons back. Lights
/// often lie in the surface of what they are fixed to.
const CLEARANCE: f32 = 1e-4;

impl AreaLight {
    /// The directions of its photons.
    pub(super) fn emission_cone(&self) -> EmissionCone {
        let shaped = self.emission.cone();
        let (normal, cos_normals) = self.normal_cone();
        let is_flat = cos_normals == 1.0;
        match shaped {
            None if is_flat => EmissionCone::cosine(normal, FRAC_PI_2),
            // The cosines to the axis and to the normal are the same.
            Some((axis, half_angle)) if is_flat && axis.dot(normal) > 0.9999 => {
                EmissionCone::cosine(normal, half_angle)
            }
            Some((axis, half_angle)) => EmissionCone::even(axis, half_angle),
            None => EmissionCone::even(Vec3::Z, PI),
        }
    }

    /// A ray that leaves the light along the unit vector `dir`, which was chosen with the density
    /// `pdf_direction`; none where the light does not shine.
    pub(super) fn emit(
        &self,
        (dir, pdf_direction): (Vec3, f32),
        u_point: Vec2,
        textures: &TextureStore,
    ) -> Option<LightRay> {
        let cross_section = self.cross_section(dir)?;
        let p_unit = self.shape.emission_point(self.unit_direction(dir), u_point);
        Some(LightRay {
            p: self.center + self.engine_from_unit * p_unit,
            dir,
            radiance: self.emission.radiance(dir, self.shape.st(p_unit), textures),
            cross_section,
            pdf_direction,
            is_delta: false,
            clearance: CLEARANCE * self.area.sqrt(),
        })
    }

    /// Area of the light's shadow along the unit vector `dir`, as far as its emitting side looks
    /// there; none where it does not.
    ///
    /// A patch with the area vector a·n of the unit shape has the shadow a·(cof(M) n)·dir, which is
    /// a·n·(cof(M)ᵀ dir): the shadow of the unit shape in another direction.
    pub(super) fn cross_section(&self, dir: Vec3) -> Option<f32> {
        let area = self.shape.cross_section(self.unit_direction(dir));
        (area > 0.0).then_some(area)
    }

    /// Light power in watts over all directions, of the mean color of its texture.
    pub(super) fn flux(&self, textures: &TextureStore) -> Spectrum {
        let radiance = self.emission.mean_radiance(textures);
        if self.emission.cone().is_none() {
            return radiance * (PI * self.area);
        }
        let cone = self.emission_cone();
        let through = |i: u32| {
            let u = Vec2::new((i % N_FLUX) as f32 + 0.5, (i / N_FLUX) as f32 + 0.5);
            let (dir, pdf) = cone.sample(u / N_FLUX as f32);
            let area = self.cross_section(dir).unwrap_or(0.0);
            self.emission.shape_factor(dir) * (area / pdf)
        };
        let sum: Spectrum = (0..N_FLUX * N_FLUX).map(through).sum();
        radiance * sum / (N_FLUX * N_FLUX) as f32
    }

    /// A direction as the unit shape sees it, times the ratio of shadows there and here.
    fn unit_direction(&self, dir: Vec3) -> Vec3 {
        self.cofactor.transpose() * dir
    }
}

impl UnitShape {
    /// Area of the shadow along `w`, times the length of `w`; negative behind flat shapes.
    fn cross_section(self, w: Vec3) -> f32 {
        match self {
            Self::Square => -w.z,
            Self::Disk => -PI * w.z,
            Self::Sphere => PI * w.length(),
            Self::Tube => 2.0 * w.y.hypot(w.z),
        }
    }

    /// A point of the side that looks along `w`; its shadow is uniform.
    fn emission_point(self, w: Vec3, u: Vec2) -> Vec3 {
        match self {
            Self::Square | Self::Disk => self.sample(u).0,
            Self::Sphere => {
                let disk = warp::concentric_disk(u);
                let height = (1.0 - disk.length_squared()).max(0.0).sqrt();
                Frame::from_z(w.normalize_or(Vec3::Z)).from_local(disk.extend(height))
            }
            Self::Tube => {
                let toward = Vec3::new(0.0, w.y, w.z).normalize_or(Vec3::Y);
                let across = 2.0 * u.y - 1.0;
                let height = (1.0 - across * across).max(0.0).sqrt();
                Vec3::X * (u.x - 0.5) + Vec3::X.cross(toward) * across + toward * height
            }
        }
    }
}
