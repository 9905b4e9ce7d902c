//! What a shader's source needs: `use kilauea_shading::prelude::*;`.

pub use kilauea_bsdf::Bsdf;
pub use kilauea_math::{Frame, Spectrum, Vec2, Vec3};

pub use crate::{
    Declaration, Input, Medium, Scattered, Shade, ShaderError, ShaderInputs, Surface,
    SurfaceShader, TextureStore, parameters,
};
