use kilauea_math::{DAffine3, DVec3};

use crate::{CurvesChunk, MeshChunk, PointsChunk, Visibility};

/// Geometry that is placed any number of times; prototype 0 is the world and is placed once.
#[derive(Clone, Debug, Default)]
pub struct Prototype {
    /// Source prim, for messages.
    pub path: String,
    /// The point of prototype space that chunk positions are relative to.
    pub center: DVec3,
    /// Triangles.
    pub chunks: Vec<MeshChunk>,
    /// Curves.
    pub curves: Vec<CurvesChunk>,
    /// Spheres.
    pub points: Vec<PointsChunk>,
    /// Prototypes placed inside this one; the relation has no cycle.
    pub instances: Vec<Instances>,
}

impl Prototype {
    /// Whether nothing is in it, placed prototypes aside.
    pub fn has_no_surfaces(&self) -> bool {
        self.chunks.is_empty() && self.curves.is_empty() && self.points.is_empty()
    }

    /// Chunks of any kind.
    pub fn n_chunks(&self) -> usize {
        self.chunks.len() + self.curves.len() + self.points.len()
    }

    /// Bytes of all chunk arrays.
    pub fn n_bytes(&self) -> usize {
        let meshes: usize = self.chunks.iter().map(MeshChunk::n_bytes).sum();
        let curves: usize = self.curves.iter().map(CurvesChunk::n_bytes).sum();
        let points: usize = self.points.iter().map(PointsChunk::n_bytes).sum();
        meshes + curves + points
    }
}

/// One prototype placed many times.
#[derive(Clone, Debug)]
pub struct Instances {
    /// Source prim of the instancer, for messages and the instanceId.
    pub prim_idx: u32,
    /// Index into [`crate::Scene::prototypes`].
    pub prototype: u32,
    /// From the placed prototype's space to the space of the prototype that holds these instances;
    /// at the first motion key.
    pub parent_from_prototype: Vec<DAffine3>,
    /// The same at the later motion keys, evenly spaced over the shutter and linear in between;
    /// empty where the instances stand still.
    pub later_parent_from_prototype: Vec<Vec<DAffine3>>,
    /// Which rays meet the instances, as far as their contents let them.
    pub visibility: Visibility,
    /// Per-instance primvars, which stand in for primvars of that name on the chunks.
    pub attributes: Vec<InstanceAttribute>,
}

impl Instances {
    /// The transforms of all instances at all motion keys.
    pub fn all_transforms(&self) -> impl Iterator<Item = &DAffine3> {
        let later = self.later_parent_from_prototype.iter();
        self.parent_from_prototype.iter().chain(later.flatten())
    }
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
