//! What is drawn for a path, against the densities stated for it: lights and the choice among
//! them, the lens, the shutter, and the numbers behind all.

mod camera;
mod closed_lamps;
mod faults;
pub(crate) mod lights;
pub(crate) mod lit;
mod many_lights;
mod near_triangles;
mod numbers;
