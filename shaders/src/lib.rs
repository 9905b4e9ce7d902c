//! The surface shaders, one file each.
//!
//! To add a shader, write its file and add it to the list below.

#![forbid(unsafe_code)]

mod list;
mod matte;
mod usd_preview_surface;

pub use matte::Matte;
pub use usd_preview_surface::{PreviewInputs, UsdPreviewSurface};

list::shaders! { Matte, UsdPreviewSurface }
