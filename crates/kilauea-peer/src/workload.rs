use crate::{Query, Segment, TriangleMesh};

/// A mesh and the rays that are traced against it.
#[derive(Clone, Debug)]
pub struct Workload {
    /// Name of the mesh, as in tables and files.
    pub name: String,
    /// The triangles.
    pub mesh: TriangleMesh,
    /// Sets of rays.
    pub rays: Vec<RaySet>,
}

/// Rays of one kind, in the order in which they are traced.
#[derive(Clone, Debug, PartialEq)]
pub struct RaySet {
    /// Name of the kind, as in tables and files.
    pub kind: String,
    /// What is asked of each ray.
    pub query: Query,
    /// The rays.
    pub rays: Vec<Segment>,
}
