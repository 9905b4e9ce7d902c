use kilauea_math::{Bounds3, Vec3, each_of_three};
use serde::{Deserialize, Serialize};

use crate::Visibility;
use crate::attribute::{Attribute, n_bytes};

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
    /// `n_vertices` points, at the first motion key.
    pub positions: Vec<[f32; 3]>,
    /// Indices of the three vertices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// `n_vertices` unit shading normals; absent where the mesh is faceted.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Only the primvars that the material reads.
    pub attributes: Vec<Attribute>,
    /// Whether the back side may be seen; false only permits culling, which we never do.
    pub double_sided: bool,
    /// The later motion keys, evenly spaced over the shutter and linear in between; empty where
    /// the mesh stands still.
    pub later_keys: Vec<MeshKey>,
    /// Which rays meet the mesh.
    pub visibility: Visibility,
}

/// A mesh at a motion key after the first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeshKey {
    /// `n_vertices` points.
    pub positions: Vec<[f32; 3]>,
    /// `n_vertices` unit shading normals; present where the chunk's are.
    pub normals: Option<Vec<[f32; 3]>>,
}

impl MeshChunk {
    /// The three corner points of a triangle.
    #[inline]
    pub fn corners(&self, triangle_idx: usize) -> [Vec3; 3] {
        let position = |v: u32| Vec3::from_array(self.positions[v as usize]);
        each_of_three(self.triangles[triangle_idx], position)
    }

    /// The box around all vertices at all times.
    pub fn bounds(&self) -> Bounds3 {
        let keys = self.later_keys.iter().map(|key| &key.positions);
        let positions = std::iter::once(&self.positions).chain(keys).flatten();
        Bounds3::from_points(positions.map(|&p| Vec3::from_array(p)))
    }

    /// All that is said of the chunk, without what is in it: what is known of chunks that lie on
    /// other machines.
    #[must_use]
    pub fn husk(&self) -> Self {
        let key = |normals: &Option<_>| MeshKey {
            positions: Vec::new(),
            normals: normals.as_ref().map(|_| Vec::new()),
        };
        let MeshKey { positions, normals } = key(&self.normals);
        Self {
            positions,
            triangles: Vec::new(),
            normals,
            attributes: self.attributes.iter().map(Attribute::husk).collect(),
            later_keys: self.later_keys.iter().map(|k| key(&k.normals)).collect(),
            ..*self
        }
    }

    /// Bytes held by the arrays.
    pub fn n_bytes(&self) -> usize {
        let triples = |positions: &Vec<_>, normals: &Option<Vec<_>>| {
            positions.len() + normals.as_ref().map_or(0, Vec::len)
        };
        let keys = self.later_keys.iter();
        let later: usize = keys.map(|key| triples(&key.positions, &key.normals)).sum();
        12 * (triples(&self.positions, &self.normals) + later + self.triangles.len())
            + n_bytes(&self.attributes)
    }
}
