use kilauea_shading::prelude::*;

parameters! {
    /// Ideal diffuse surface: scatters light evenly over the hemisphere.
    pub struct Matte {
        /// Fraction of light reflected.
        albedo: Spectrum = ("albedo", Spectrum::splat(0.18), 0.0..=1.0),
        /// Presence: 1 is solid, 0 is not there.
        opacity: f32 = ("opacity", 1.0, 0.0..=1.0),
    }
}

impl SurfaceShader for Matte {
    const NAME: &'static str = "Matte";

    fn declaration() -> Declaration {
        Self::declaration()
    }

    fn compile(inputs: &mut ShaderInputs<'_>) -> Result<Self, ShaderError> {
        Self::read(inputs)
    }

    fn bsdf(&self, surface: &Surface<'_>) -> Bsdf {
        let albedo = self.albedo.at(surface).clamp(0.0, 1.0);
        Bsdf::lambert(Frame::from_z(surface.ns), surface.ng, albedo)
    }

    fn opacity(&self, surface: &Surface<'_>) -> f32 {
        self.opacity.at(surface).clamp(0.0, 1.0)
    }

    fn is_opaque(&self) -> bool {
        self.opacity
            .constant()
            .is_some_and(|opacity| opacity >= 1.0)
    }
}
