//! Photons of each kind of light, against the densities stated for them and against what the light
//! sends to a receiver by the estimate of paths.

mod aimed;
mod cases;
mod densities;
mod power;
