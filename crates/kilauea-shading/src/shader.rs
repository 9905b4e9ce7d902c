use kilauea_bsdf::Bsdf;
use kilauea_math::Spectrum;

use crate::sum::Sum;
use crate::{Declaration, Medium, Scattered, Shade, ShaderInputs, Surface, TextureStore};

/// A surface shader: turns its inputs at a point into scattering, emission and presence.
pub trait SurfaceShader: Send + Sync + Sized {
    /// The name that materials call it by.
    const NAME: &'static str;

    /// What it is like, and its inputs: names, types, defaults, allowed values, documentation.
    fn declaration() -> Declaration;

    /// Reads the inputs of a material and prepares what does not vary over a surface.
    fn compile(inputs: &mut ShaderInputs<'_>) -> Result<Self, ShaderError>;

    /// How the surface scatters light at a point.
    fn bsdf(&self, surface: &Surface<'_>) -> Bsdf;

    /// Light scattered toward `surface.wo`, as in a ray tracer that has everything at hand: what is
    /// awaited may be answered on the spot or by another machine.
    ///
    /// A shader of its own mind writes an `async fn` that ends in `direct.await + indirect.await`.
    /// This one is the same and keeps less while it waits.
    fn shade(&self, mut cx: impl Shade) -> impl Future<Output = Scattered> {
        let surface = cx.surface();
        let bsdf = self.bsdf(surface).seen_from(surface.wo);
        let direct = cx.direct_light(&bsdf); // ask first ...
        let indirect = cx.indirect(&bsdf);
        Sum::new(direct, indirect) // ... read later
    }

    /// Radiance emitted toward `surface.wo`.
    fn emission(&self, _surface: &Surface<'_>) -> Spectrum {
        Spectrum::BLACK
    }

    /// Presence in [0, 1]: the fraction of the surface that is there at all. Rays pass the rest
    /// as if nothing were there.
    fn opacity(&self, _surface: &Surface<'_>) -> f32 {
        1.0
    }

    /// What fills the inside of a closed mesh with this surface; none where that makes no
    /// difference to light. Paths keep track of it from where a ray is transmitted to the inside.
    fn interior(&self) -> Option<Medium> {
        None
    }

    /// Whether [`Self::opacity`] is 1 everywhere.
    fn is_opaque(&self) -> bool {
        true
    }

    /// Whether [`Self::emission`] can be anything but black.
    fn is_emissive(&self) -> bool {
        false
    }

    /// [`Self::emission`] where it is the same everywhere.
    fn constant_emission(&self) -> Option<Spectrum> {
        (!self.is_emissive()).then_some(Spectrum::BLACK)
    }

    /// A guess at the mean of [`Self::emission`] over all surfaces, for the choice of lights; not
    /// black where the shader is emissive, but possibly far off where primvars decide.
    fn mean_emission(&self, _textures: &TextureStore) -> Spectrum {
        Spectrum::BLACK
    }
}

/// Why a material cannot be shaded; each names the material's prim.
#[derive(Debug, thiserror::Error)]
pub enum ShaderError {
    /// No shader has that name.
    #[error("{material}: unknown surface shader {shader:?}; known are {known}")]
    UnknownShader {
        /// Prim path of the material.
        material: String,
        /// The name asked for.
        shader: String,
        /// Names that exist.
        known: String,
    },
    /// A node that does not exist, or that depends on itself.
    #[error("{material}: nodes[{node}] is missing or refers to a later node")]
    Node {
        /// Prim path of the material.
        material: String,
        /// Index of the node.
        node: u32,
    },
    /// An input with a value that makes no sense.
    #[error("{material}: inputs:{input} is {value}; expected {expected}")]
    Value {
        /// Prim path of the material.
        material: String,
        /// Name of the input.
        input: String,
        /// What was found.
        value: String,
        /// What would be right.
        expected: String,
    },
}
