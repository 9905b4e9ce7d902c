use kilauea_bsdf::Layers;
use kilauea_shading::prelude::*;

parameters! {
    /// Smooth boundary between air and a dielectric, which lies inside of the mesh.
    pub struct Glass {
        /// Fraction of the refracted light that passes, each time it crosses the surface.
        tint: Spectrum = ("tint", Spectrum::ONE, 0.0..=1.0),
        /// Index of refraction of the inside over that of the outside.
        ior: f32 = ("ior", 1.5, 0.1..=10.0),
    }
}

impl SurfaceShader for Glass {
    const NAME: &'static str = "Glass";

    fn declaration() -> Declaration {
        Self::declaration()
    }

    fn compile(inputs: &mut ShaderInputs<'_>) -> Result<Self, ShaderError> {
        Self::read(inputs)
    }

    fn bsdf(&self, surface: &Surface<'_>) -> Bsdf {
        let glass = Layers {
            transmission: 1.0,
            transmission_tint: self.tint.at(surface),
            ior: self.ior.at(surface).clamp(0.1, 10.0),
            ..Layers::default()
        };
        let ns = surface.reflecting_normal(surface.ns);
        Bsdf::layered(Frame::from_z(ns), surface.ng, &glass)
    }
}
