//! Points, directions, spectra, frames, bounds and sampling warps.
//!
//! Vector types are `glam`'s; `Vec3` holds points, directions and normals alike, so names carry
//! the meaning and the space (`p_world`, `n_local`, `world_from_object`).

#![forbid(unsafe_code)]

mod bounds;
mod frame;
pub mod hash;
mod hypot;
pub mod octahedral;
mod packed_spectrum;
mod spectrum;
mod triple;
pub mod warp;

pub use bounds::Bounds3;
pub use frame::Frame;
pub use glam::{DAffine3, DMat3, DMat4, DVec2, DVec3, Mat2, Mat3, UVec2, Vec2, Vec3, Vec3A, Vec4};
pub use hypot::hypot;
pub use packed_spectrum::PackedSpectrum;
pub use spectrum::Spectrum;
pub use triple::each_of_three;

/// One over pi.
pub const INV_PI: f32 = std::f32::consts::FRAC_1_PI;

/// Bound on the relative error of `n` chained roundings in `f32` (Higham; PBR 4ed., eq. 6.4).
#[inline]
pub const fn gamma(n: u32) -> f32 {
    const UNIT_ROUNDOFF: f32 = f32::EPSILON * 0.5;
    let n_eps = n as f32 * UNIT_ROUNDOFF;
    n_eps / (1.0 - n_eps)
}
