//! Scenes and checks shared by the integration tests.

#![forbid(unsafe_code)]

mod camera;
mod curves;
mod light;
mod material;
mod mesh;
mod picture;
mod points;
mod stage;

pub use camera::{looking_down, orthographic, perspective};
pub use curves::Curves;
pub use kilauea_testing::TileFile;
pub use light::{facing_down, light, rect_light, wall_light};
pub use material::{black_emitter, glass, matte, matte_from_primvar, preview, with_opacity};
pub use mesh::{Mesh, MeshPrimvar};
pub use picture::{Picture, check_near, rel_mse};
pub use points::Points;
pub use stage::{Placements, Sphere, Stage};
