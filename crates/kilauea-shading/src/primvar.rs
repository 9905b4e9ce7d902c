use kilauea_scene::{
    Attribute, CurvesChunk, InstanceAttribute, Interpolation, MeshChunk, PointsChunk,
};

use crate::graph::Channels;

/// Where the primvars of a material are found on a chunk.
///
/// Resolved once for each pair of material and chunk, and again for placements whose per-instance
/// primvars differ, so that no name is compared while shading.
#[derive(Clone, Copy, Debug)]
pub struct PrimvarLayout;

/// Where one primvar is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PrimvarSlot {
    /// Nowhere: the reader's fallback applies.
    Missing,
    /// Index into the chunk's attributes.
    Chunk(u32),
    /// Index into the per-instance primvars.
    Instance(u32),
}

/// How many values the attributes of a chunk must have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ElementCounts {
    /// Triangles or segments.
    pub uniform: usize,
    /// Vertices, control points or points.
    pub vertex: usize,
}

impl From<&MeshChunk> for ElementCounts {
    fn from(chunk: &MeshChunk) -> Self {
        Self {
            uniform: chunk.triangles.len(),
            vertex: chunk.positions.len(),
        }
    }
}

impl From<&CurvesChunk> for ElementCounts {
    fn from(chunk: &CurvesChunk) -> Self {
        Self {
            uniform: chunk.segments.len(),
            vertex: chunk.points.len(),
        }
    }
}

impl From<&PointsChunk> for ElementCounts {
    fn from(chunk: &PointsChunk) -> Self {
        let n = chunk.centers.len();
        Self {
            uniform: n,
            vertex: n,
        }
    }
}

impl PrimvarLayout {
    /// Finds each of `names` (a shader's primvars, in slot order) on a chunk or its instances;
    /// a per-instance primvar stands in for the chunk's.
    ///
    /// An attribute whose array is too short for the chunk counts as missing.
    pub fn resolve(
        names: &[String],
        attributes: &[Attribute],
        counts: ElementCounts,
        instance_attributes: &[InstanceAttribute],
    ) -> Vec<PrimvarSlot> {
        let find = |name: &String| {
            let on_instances = instance_attributes
                .iter()
                .position(|a| a.name == *name && (1..=4).contains(&a.width))
                .map(|idx| PrimvarSlot::Instance(idx as u32));
            let on_chunk = || {
                attributes
                    .iter()
                    .position(|a| a.name == *name && Self::is_complete(a, counts))
                    .map(|idx| PrimvarSlot::Chunk(idx as u32))
            };
            on_instances
                .or_else(on_chunk)
                .unwrap_or(PrimvarSlot::Missing)
        };
        names.iter().map(find).collect()
    }

    /// Whether an attribute has all the values that its chunk calls for.
    pub fn is_complete(attribute: &Attribute, counts: ElementCounts) -> bool {
        let n_values = match attribute.interpolation {
            Interpolation::Constant => 1,
            Interpolation::Uniform => counts.uniform,
            Interpolation::Vertex => counts.vertex,
        };
        let width = attribute.width as usize;
        (1..=4).contains(&width) && attribute.data.len() >= n_values * width
    }
}

/// Value `idx` of an array of `width` floats each; unused channels are 0, the fourth is 1. None
/// outside the array.
#[inline]
pub(crate) fn value(data: &[f32], width: u8, idx: usize) -> Option<Channels> {
    let width = width as usize;
    let floats = data.get(idx * width..(idx + 1) * width)?;
    // One by one: a copy of some few floats whose number is not known is a call.
    Some(match *floats {
        [r] => [r, 0.0, 0.0, 1.0],
        [r, g] => [r, g, 0.0, 1.0],
        [r, g, b] => [r, g, b, 1.0],
        [r, g, b, a] => [r, g, b, a],
        _ => return None,
    })
}
