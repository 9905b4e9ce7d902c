//! What the engine renders: an immutable [`Scene`] of prototypes, instances, materials, lights
//! and a camera, and the settings of one frame.
//!
//! The control records ([`Material`], [`Light`], [`Camera`], [`RenderSettings`]) are plain serde
//! data; the bulk ([`MeshChunk`], [`CurvesChunk`], [`PointsChunk`]) is plain arrays. Both cross process and machine boundaries as
//! they are. Nothing here knows where a scene came from.

#![forbid(unsafe_code)]

mod attribute;
mod camera;
mod chunk;
mod curves;
mod error;
mod export;
mod instance;
mod light;
mod material;
mod photon_settings;
mod points;
mod prototype_check;
mod scene;
mod settings;
mod visibility;

pub use attribute::{Attribute, Interpolation};
pub use camera::{Camera, Projection};
pub use chunk::{MeshChunk, MeshKey};
pub use curves::{CurveBasis, CurveProfile, CurvesChunk};
pub use error::SceneError;
pub use instance::{InstanceAttribute, Instances, Prototype};
pub use light::{Light, LightShape, Shaping};
pub use material::{Channel, Input, Material, Node, NodeIdx, TextureFile, TextureSource, Wrap};
pub use photon_settings::{Aim, CausticStrategy, FinalGathering, PhotonSettings, PhotonSplit};
pub use points::PointsChunk;
pub use scene::Scene;
pub use settings::{
    DataWindow, FilterKind, GlobalIllumination, Integrator, RenderSettings, Shading,
};
pub use visibility::Visibility;
