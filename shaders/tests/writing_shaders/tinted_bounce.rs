use kilauea_shading::prelude::*;

parameters! {
    /// Matte, with a tint on light that comes by way of other surfaces.
    pub struct TintedBounce {
        /// Fraction of light reflected.
        albedo: Spectrum = ("albedo", Spectrum::splat(0.18), 0.0..=1.0),
        /// Factor of indirect light.
        bounce: Spectrum = ("bounce", Spectrum::ONE),
    }
}

impl SurfaceShader for TintedBounce {
    const NAME: &'static str = "TintedBounce";

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

    async fn shade(&self, mut cx: impl Shade) -> Scattered {
        let surface = cx.surface();
        let bsdf = self.bsdf(surface).seen_from(surface.wo);
        let bounce = self.bounce.at(surface).max(0.0);
        let direct = cx.direct_light(&bsdf); // ask first ...
        let indirect = cx.indirect(&bsdf);
        direct.await + indirect.await * bounce // ... read later
    }
}
