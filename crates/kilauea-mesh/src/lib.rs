//! Turns polygon meshes, subdivision cages, implicit shapes, curves, points and instances into a
//! [`kilauea_scene::Scene`] of chunks.
//!
//! The vocabulary is UsdGeom's, but nothing here reads USD: [`Payloads`] borrows plain arrays, and
//! [`assemble`] makes the scene from them.

#![forbid(unsafe_code)]

mod assemble;
mod bounds;
mod channel;
mod chunks;
mod curves;
mod implicit;
mod instancing;
mod motion;
mod nearest;
mod payload;
mod pieces;
mod points;
mod polygon;
mod report;
mod shape;
mod spaces;
mod subdiv;
mod surface;
mod tokens;
mod triangulate;
mod weld;

pub use assemble::{AssembleOptions, Assembled, assemble};
pub use payload::{
    BasisCurves, ImplicitShape, InstancesPayload, MeshPose, Payloads, Points, PolyMesh, Primvar,
    Subdivision, Subset,
};
pub use tokens::{
    Axis, BoundaryInterpolation, CubicBasis, CurveType, CurveWrap, FaceVaryingRule, ImplicitKind,
    PrimvarInterpolation, Scheme, TriangleRule, UnknownToken,
};
