use kilauea_scene::{InstanceAttribute, Interpolation, MeshChunk};

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
    /// Index into [`MeshChunk::attributes`].
    Chunk(u32),
    /// Index into the per-instance primvars.
    Instance(u32),
}

impl PrimvarLayout {
    /// Finds each of `names` (a shader's primvars, in slot order) on the chunk or its instances;
    /// a per-instance primvar stands in for the chunk's.
    ///
    /// An attribute whose array is too short for the chunk counts as missing.
    pub fn resolve(
        names: &[String],
        chunk: &MeshChunk,
        instance_attributes: &[InstanceAttribute],
    ) -> Vec<PrimvarSlot> {
        let find = |name: &String| {
            let on_instances = instance_attributes
                .iter()
                .position(|a| a.name == *name && (1..=4).contains(&a.width))
                .map(|idx| PrimvarSlot::Instance(idx as u32));
            let on_chunk = || {
                chunk
                    .attributes
                    .iter()
                    .position(|a| a.name == *name && is_complete(a, chunk))
                    .map(|idx| PrimvarSlot::Chunk(idx as u32))
            };
            on_instances
                .or_else(on_chunk)
                .unwrap_or(PrimvarSlot::Missing)
        };
        names.iter().map(find).collect()
    }
}

fn is_complete(attribute: &kilauea_scene::Attribute, chunk: &MeshChunk) -> bool {
    let n_values = match attribute.interpolation {
        Interpolation::Constant => 1,
        Interpolation::Uniform => chunk.triangles.len(),
        Interpolation::Vertex => chunk.positions.len(),
    };
    let width = attribute.width as usize;
    (1..=4).contains(&width) && attribute.data.len() >= n_values * width
}

/// Value `idx` of an array of `width` floats each; unused channels are 0, the fourth is 1. None
/// outside the array.
#[inline]
pub(crate) fn value(data: &[f32], width: u8, idx: usize) -> Option<Channels> {
    let width = width as usize;
    let floats = data.get(idx * width..(idx + 1) * width)?;
    let mut channels = [0.0, 0.0, 0.0, 1.0];
    channels[..width].copy_from_slice(floats);
    Some(channels)
}
