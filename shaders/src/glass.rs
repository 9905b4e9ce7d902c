use kilauea_bsdf::Layers;
use kilauea_shading::prelude::*;

parameters! {
    /// Smooth boundary of a dielectric, which fills the inside of the closed mesh. Where such
    /// insides overlap, only the one of the highest priority is there.
    pub struct GlassInputs {
        /// Fraction of the refracted light that passes, each time it crosses the surface.
        tint: Spectrum = ("tint", Spectrum::ONE, 0.0..=1.0),
        /// Index of refraction of the inside; that of air is 1. The same everywhere.
        ior: f32 = ("ior", 1.5, 0.1..=10.0),
        /// What the inside makes of white light on the way through `transmissionDepth`. The same
        /// everywhere.
        transmission_color: Spectrum = ("transmissionColor", Spectrum::ONE, 0.0..=1.0),
        /// Distance, in units of the stage, after which white light has `transmissionColor`; 0
        /// for an inside that absorbs nothing. The same everywhere.
        transmission_depth: f32 = ("transmissionDepth", 0.0, 0.0..=f32::INFINITY),
        /// Which of overlapping insides is there: the one with the highest number, and among
        /// equals the one that a path entered last. The same everywhere.
        priority: i32 = ("priority", 0, -100.0..=100.0),
    }
}

/// A smooth dielectric that keeps its place among others.
#[derive(Clone, Debug)]
pub struct Glass {
    tint: Input<Spectrum>,
    interior: Medium,
}

impl SurfaceShader for Glass {
    const NAME: &'static str = "Glass";

    fn declaration() -> Declaration {
        GlassInputs::declaration()
    }

    fn compile(inputs: &mut ShaderInputs<'_>) -> Result<Self, ShaderError> {
        let read = GlassInputs::read(inputs)?;
        let ior = inputs.uniform("ior", &read.ior, 1.5);
        let color = inputs.uniform("transmissionColor", &read.transmission_color, Spectrum::ONE);
        let depth = inputs.uniform("transmissionDepth", &read.transmission_depth, 0.0);
        let priority = inputs.uniform("priority", &read.priority, 0);
        Ok(Self {
            tint: read.tint,
            interior: Medium {
                ior: ior.clamp(0.1, 10.0),
                priority: priority.clamp(-100, 100) as i8,
                absorption: Medium::absorption(color, depth),
            },
        })
    }

    fn bsdf(&self, surface: &Surface<'_>) -> Bsdf {
        let glass = Layers {
            transmission: 1.0,
            transmission_tint: self.tint.at(surface),
            ior: self.interior.ior / surface.outside_ior,
            ..Layers::default()
        };
        let ns = surface.reflecting_normal(surface.ns);
        Bsdf::layered(Frame::from_z(ns), surface.ng, &glass)
    }

    fn interior(&self) -> Option<Medium> {
        Some(self.interior)
    }
}
