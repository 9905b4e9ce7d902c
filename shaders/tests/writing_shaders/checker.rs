use kilauea_shading::prelude::*;

parameters! {
    /// Matte squares of two colors.
    pub struct Checker {
        /// Color of the square at the origin.
        even: Spectrum = ("even", Spectrum::splat(0.8), 0.0..=1.0),
        /// Color of its neighbours.
        odd: Spectrum = ("odd", Spectrum::splat(0.1), 0.0..=1.0),
        /// Texture coordinates.
        st: Vec3 = ("st", Vec3::ZERO),
        /// Squares per unit of `st`.
        frequency: f32 = ("frequency", 8.0),
    }
}

impl SurfaceShader for Checker {
    const NAME: &'static str = "Checker";

    fn declaration() -> Declaration {
        Self::declaration()
    }

    fn compile(inputs: &mut ShaderInputs<'_>) -> Result<Self, ShaderError> {
        Self::read(inputs)
    }

    fn bsdf(&self, surface: &Surface<'_>) -> Bsdf {
        let square = (self.st.at(surface) * self.frequency.at(surface)).floor();
        let is_even = (square.x + square.y).rem_euclid(2.0) == 0.0;
        let color = if is_even { &self.even } else { &self.odd };
        let albedo = color.at(surface).clamp(0.0, 1.0);
        Bsdf::lambert(Frame::from_z(surface.ns), surface.ng, albedo)
    }
}
