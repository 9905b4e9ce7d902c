//! What the engine renders: an immutable [`Scene`] of prototypes, instances, materials, lights
//! and a camera, and the settings of one frame.
//!
//! The control records ([`Material`], [`Light`], [`Camera`], [`RenderSettings`]) are plain serde
//! data; the bulk ([`MeshChunk`]) is plain arrays. Both cross process and machine boundaries as
//! they are. Nothing here knows where a scene came from.

#![forbid(unsafe_code)]

mod camera;
mod chunk;
mod error;
mod export;
mod instance;
mod light;
mod material;
mod scene;
mod settings;

pub use camera::{Camera, Projection};
pub use chunk::{Attribute, Interpolation, MeshChunk};
pub use error::SceneError;
pub use instance::{InstanceAttribute, Instances, Prototype};
pub use light::{Light, LightShape, Shaping};
pub use material::{Channel, Input, Material, Node, NodeIdx, TextureFile, TextureSource, Wrap};
pub use scene::Scene;
pub use settings::{DataWindow, FilterKind, RenderSettings};
