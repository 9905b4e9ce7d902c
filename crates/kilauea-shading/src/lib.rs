//! What a shader sees: the [`Surface`], its [`Input`]s, and the [`SurfaceShader`] trait it
//! implements.
//!
//! A material's pattern graph is compiled once: constants are folded, primvars become slots, and
//! each input is either a value or a small tree that is evaluated at a surface without allocating.

#![forbid(unsafe_code)]

mod declaration;
mod graph;
mod input;
mod lookups;
mod medium;
mod normal;
mod parameters;
pub mod prelude;
mod primvar;
mod shade;
mod shader;
mod sum;
mod surface;
#[cfg(test)]
mod testing;

pub use declaration::{Allowed, Declaration, Parameter};
pub use graph::Channels;
pub use input::{Input, InputValue};
pub use kilauea_texture::{TextureStore, TileId};
pub use lookups::Lookups;
pub use medium::Medium;
pub use parameters::{InputSummary, ShaderInputs};
pub use primvar::{ElementCounts, PrimvarLayout, PrimvarSlot};
pub use shade::{Scattered, Shade};
pub use shader::{ShaderError, SurfaceShader};
pub use surface::{Element, Surface};
