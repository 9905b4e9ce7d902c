//! The surface shaders, one file each.
//!
//! To add a shader, write its file and add it to the list below.

#![forbid(unsafe_code)]

mod list;
mod matte;

pub use matte::Matte;

list::shaders! { Matte }
