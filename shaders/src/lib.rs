//! The surface shaders, one file each.
//!
//! To add a shader, write its file and add it to the list below.

#![forbid(unsafe_code)]

pub mod describe;
mod glass;
mod list;
mod matte;
mod mirror;
mod usd_preview_surface;

pub use glass::{Glass, GlassInputs};
pub use matte::Matte;
pub use mirror::Mirror;
pub use usd_preview_surface::{PreviewInputs, UsdPreviewSurface};

list::shaders! { Glass, Matte, Mirror, UsdPreviewSurface }
