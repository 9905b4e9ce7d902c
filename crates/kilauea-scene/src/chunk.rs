use kilauea_math::{Bounds3, Vec3};
use serde::{Deserialize, Serialize};

/// A self-contained piece of triangle mesh with one material: the unit that is built, traced,
/// shaded, and sent to other machines.
///
/// Positions are in the space of the chunk's prototype, relative to [`crate::Prototype::center`].
/// Triangles are wound counter-clockwise as seen from the outside, whatever the orientation and
/// mirroring of the source.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeshChunk {
    /// Index of the source mesh in [`crate::Scene::prim_paths`]: the primId.
    pub prim_idx: u32,
    /// Index into [`crate::Scene::materials`].
    pub material: u32,
    /// `n_vertices` points.
    pub positions: Vec<[f32; 3]>,
    /// Indices of the three vertices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// `n_vertices` unit shading normals; absent where the mesh is faceted.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Only the primvars that the material reads.
    pub attributes: Vec<Attribute>,
    /// Whether the back side may be seen; false only permits culling, which we never do.
    pub double_sided: bool,
}

impl MeshChunk {
    /// The three corner points of a triangle.
    #[inline]
    pub fn corners(&self, triangle_idx: usize) -> [Vec3; 3] {
        self.triangles[triangle_idx].map(|v| Vec3::from_array(self.positions[v as usize]))
    }

    /// The box around all vertices.
    pub fn bounds(&self) -> Bounds3 {
        Bounds3::from_points(self.positions.iter().map(|&p| Vec3::from_array(p)))
    }

    /// Bytes held by the arrays.
    pub fn n_bytes(&self) -> usize {
        let attributes: usize = self.attributes.iter().map(|a| 4 * a.data.len()).sum();
        12 * (self.positions.len() + self.triangles.len())
            + 12 * self.normals.as_ref().map_or(0, Vec::len)
            + attributes
    }
}

/// How an [`Attribute`] varies over a chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub enum Interpolation {
    /// One value.
    Constant,
    /// One value per triangle.
    Uniform,
    /// One value per vertex, linear in between.
    Vertex,
}

/// A primvar: `width` floats per value, values as [`Interpolation`] counts them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attribute {
    /// Name without the `primvars:` prefix.
    pub name: String,
    /// Floats per value, 1 to 4.
    pub width: u8,
    /// How values map to the chunk.
    pub interpolation: Interpolation,
    /// The values, `width` floats each.
    pub data: Vec<f32>,
}
