use kilauea_bsdf::Layers;
use kilauea_shading::prelude::*;

parameters! {
    /// Ideal metal: reflects the same fraction of light at every angle, sharply or brushed.
    pub struct Mirror {
        /// Fraction of light reflected.
        tint: Spectrum = ("tint", Spectrum::ONE, 0.0..=1.0),
        /// 0 is a perfect mirror. Its square is GGX's alpha.
        roughness: f32 = ("roughness", 0.0, 0.0..=1.0),
    }
}

impl SurfaceShader for Mirror {
    const NAME: &'static str = "Mirror";

    fn declaration() -> Declaration {
        Self::declaration()
    }

    fn compile(inputs: &mut ShaderInputs<'_>) -> Result<Self, ShaderError> {
        Self::read(inputs)
    }

    fn bsdf(&self, surface: &Surface<'_>) -> Bsdf {
        let tint = self.tint.at(surface);
        let metal = Layers {
            f0: tint,
            f90: tint,
            roughness: self.roughness.at(surface),
            ..Layers::default()
        };
        let ns = surface.reflecting_normal(surface.ns);
        Bsdf::layered(Frame::from_z(ns), surface.ng, &metal)
    }
}
