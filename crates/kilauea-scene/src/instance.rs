use kilauea_math::{DAffine3, DVec3};

use crate::MeshChunk;

/// Geometry that is placed any number of times; prototype 0 is the world and is placed once.
#[derive(Clone, Debug, Default)]
pub struct Prototype {
    /// Source prim, for messages.
    pub path: String,
    /// The point of prototype space that chunk positions are relative to.
    pub center: DVec3,
    /// Triangles.
    pub chunks: Vec<MeshChunk>,
    /// Prototypes placed inside this one; the relation has no cycle.
    pub instances: Vec<Instances>,
}

/// One prototype placed many times.
#[derive(Clone, Debug)]
pub struct Instances {
    /// Source prim of the instancer, for messages and the instanceId.
    pub prim_idx: u32,
    /// Index into [`crate::Scene::prototypes`].
    pub prototype: u32,
    /// From the placed prototype's space to the space of the prototype that holds these instances.
    pub parent_from_prototype: Vec<DAffine3>,
    /// Per-instance primvars, which stand in for primvars of that name on the chunks.
    pub attributes: Vec<InstanceAttribute>,
}

/// A primvar with one value per instance.
#[derive(Clone, Debug, PartialEq)]
pub struct InstanceAttribute {
    /// Name without the `primvars:` prefix.
    pub name: String,
    /// Floats per value, 1 to 4.
    pub width: u8,
    /// `width` floats per instance.
    pub data: Vec<f32>,
}
