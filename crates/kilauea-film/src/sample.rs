use kilauea_math::{Spectrum, Vec3};

/// What one camera path adds to its pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelSample {
    /// Radiance of the whole path, premultiplied by `alpha`.
    pub beauty: Spectrum,
    /// Opacity, 0 to 1.
    pub alpha: f32,
    /// Light scattered once, by a diffuse lobe.
    pub direct_diffuse: Spectrum,
    /// Light whose first scattering is diffuse, scattered more than once.
    pub indirect_diffuse: Spectrum,
    /// Light scattered once, by a specular or glossy lobe.
    pub direct_specular: Spectrum,
    /// Light whose first scattering is specular or glossy, scattered more than once.
    pub indirect_specular: Spectrum,
    /// Light that comes from what the camera sees itself.
    pub emission: Spectrum,
    /// Reflectance of the first hit.
    pub albedo: Spectrum,
    /// Shading normal of the first hit in world space; zero where nothing is hit.
    pub n: Vec3,
    /// First hit in engine space.
    pub p: Vec3,
    /// Distance of the first hit along the viewing axis in scene units; infinite where nothing is
    /// hit.
    pub z: f32,
    /// Prim of the first hit; -1 where nothing is hit.
    pub prim_id: i32,
    /// Instance of the first hit; -1 where there is none.
    pub instance_id: i32,
    /// Squared distance of the sample from the pixel center in pixels.
    pub offset_sq: f32,
}

impl Default for PixelSample {
    /// A path that hits nothing and sees no light.
    fn default() -> Self {
        Self {
            beauty: Spectrum::BLACK,
            alpha: 0.0,
            direct_diffuse: Spectrum::BLACK,
            indirect_diffuse: Spectrum::BLACK,
            direct_specular: Spectrum::BLACK,
            indirect_specular: Spectrum::BLACK,
            emission: Spectrum::BLACK,
            albedo: Spectrum::BLACK,
            n: Vec3::ZERO,
            p: Vec3::ZERO,
            z: f32::INFINITY,
            prim_id: -1,
            instance_id: -1,
            offset_sq: 0.0,
        }
    }
}

impl PixelSample {
    /// Scales all light.
    pub fn expose(&mut self, scale: f32) {
        for light in [
            &mut self.beauty,
            &mut self.emission,
            &mut self.direct_diffuse,
            &mut self.direct_specular,
            &mut self.indirect_diffuse,
            &mut self.indirect_specular,
        ] {
            *light *= scale;
        }
    }

    /// The same path with no light in any layer, so that the parts still add up to the beauty.
    pub(crate) fn without_light(&self) -> Self {
        Self {
            beauty: Spectrum::BLACK,
            direct_diffuse: Spectrum::BLACK,
            indirect_diffuse: Spectrum::BLACK,
            direct_specular: Spectrum::BLACK,
            indirect_specular: Spectrum::BLACK,
            emission: Spectrum::BLACK,
            ..*self
        }
    }
}
