//! Embree 4, by its C interface (`rtcore.h`).
#![allow(
    unsafe_code,
    reason = "calls into a library that is loaded at run time"
)]

mod device;
mod ffi;
mod library;
mod scene;

pub use device::Device;
pub use library::Embree;
pub use scene::{EmbreeScene, Mode};
