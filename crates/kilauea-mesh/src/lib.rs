//! Turns polygon meshes, subdivision cages, implicit shapes and instances into a
//! [`kilauea_scene::Scene`] of triangle chunks.
//!
//! The vocabulary is UsdGeom's, but nothing here reads USD: [`Payloads`] borrows plain arrays, and
//! [`assemble`] makes the scene from them.

#![forbid(unsafe_code)]

mod payload;
mod tokens;

pub use payload::{
    ImplicitShape, InstancesPayload, Payloads, PolyMesh, Primvar, Subdivision, Subset,
};
pub use tokens::{
    Axis, BoundaryInterpolation, FaceVaryingRule, ImplicitKind, PrimvarInterpolation, Scheme,
    TriangleRule, UnknownToken,
};
