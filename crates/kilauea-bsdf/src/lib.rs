//! How surfaces scatter light: pure functions of directions.
//!
//! All directions are unit vectors in world space that point away from the surface: `wo` to where
//! the path came from, `wi` to where it goes on (to the light). Radiance travels from `wi` to
//! `wo`.

#![forbid(unsafe_code)]

mod bsdf;
mod energy;
mod energy_table;
mod fresnel;
mod ggx;
mod lambert;
mod layered;
mod side;

pub use bsdf::{Bsdf, BsdfEval, BsdfSample, Mirror, SeenBsdf};
pub use fresnel::f0_from_ior;
pub use layered::Layers;
