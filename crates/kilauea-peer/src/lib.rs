//! Peer ray tracers, loaded at run time to be measured beside ours.
//!
//! [`Embree`] is a shared library that somebody else built; the renderer neither links against it
//! nor needs it. A [`Workload`] is a triangle mesh with sets of rays; [`measure`] lets our kernels
//! and Embree's trace them in turns, on one thread of one process, and compares what they hit.
//!
//! Both answer one ray at a time through their public interface, and both fill their own ray
//! structure from the same array within the measured time. The processor's floating-point mode
//! stays as Rust requires it: denormals are neither flushed nor taken as zero, for either of them.

mod agreement;
mod builds;
mod embree;
mod error;
mod files;
mod measure;
mod mesh;
mod ours;
mod rays;
mod segment;
mod shapes;
mod soup;
mod timing;
mod tracer;
mod view;
mod workload;

pub use agreement::Agreement;
pub use builds::BuildRow;
pub use embree::{Device, Embree, EmbreeScene, Mode};
pub use error::PeerError;
pub use measure::{MeasureOptions, RayRow, Report, measure};
pub use mesh::TriangleMesh;
pub use ours::Ours;
pub use segment::Segment;
pub use shapes::{Shape, shape};
pub use timing::mrays_per_s;
pub use tracer::{Query, Tally, Tracer};
pub use view::View;
pub use workload::{RaySet, Workload};
