//! Turns polygon meshes, subdivision cages, implicit shapes and instances into a
//! [`kilauea_scene::Scene`] of triangle chunks.
//!
//! The vocabulary is UsdGeom's, but nothing here reads USD: [`Payloads`] borrows plain arrays, and
//! [`assemble`] makes the scene from them.

#![forbid(unsafe_code)]

mod assemble;
mod bounds;
mod channel;
mod chunks;
mod implicit;
mod instancing;
mod nearest;
mod payload;
mod pieces;
mod polygon;
mod report;
mod subdiv;
mod surface;
mod tokens;
mod triangulate;
mod weld;

pub use assemble::{AssembleOptions, Assembled, assemble};
pub use payload::{
    ImplicitShape, InstancesPayload, Payloads, PolyMesh, Primvar, Subdivision, Subset,
};
pub use tokens::{
    Axis, BoundaryInterpolation, FaceVaryingRule, ImplicitKind, PrimvarInterpolation, Scheme,
    TriangleRule, UnknownToken,
};
