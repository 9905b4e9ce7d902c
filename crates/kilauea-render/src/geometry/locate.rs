use kilauea_accel::Hit;
use kilauea_scene::{Attribute, CurvesChunk, MeshChunk, PointsChunk, Prototype, Visibility};
use kilauea_shading::ElementCounts;
use serde::{Deserialize, Serialize};

use super::Geometry;

/// A triangle, sphere or curve segment of a placed prototype.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrimitiveRef {
    /// Placement.
    pub placement: u32,
    /// Chunk of the placement's prototype: meshes come first, then points, then curves.
    pub chunk: u32,
    /// Primitive of the chunk.
    pub primitive: u32,
}

/// A chunk of any kind.
#[derive(Clone, Copy)]
pub(super) enum Chunk<'a> {
    Mesh(&'a MeshChunk),
    Points(&'a PointsChunk),
    Curves(&'a CurvesChunk),
}

impl<'a> Chunk<'a> {
    #[inline]
    pub(super) fn material(self) -> u32 {
        match self {
            Self::Mesh(chunk) => chunk.material,
            Self::Points(chunk) => chunk.material,
            Self::Curves(chunk) => chunk.material,
        }
    }

    pub(super) fn visibility(self) -> Visibility {
        match self {
            Self::Mesh(chunk) => chunk.visibility,
            Self::Points(chunk) => chunk.visibility,
            Self::Curves(chunk) => chunk.visibility,
        }
    }

    pub(super) fn prim_idx(self) -> u32 {
        match self {
            Self::Mesh(chunk) => chunk.prim_idx,
            Self::Points(chunk) => chunk.prim_idx,
            Self::Curves(chunk) => chunk.prim_idx,
        }
    }

    pub(super) fn counts(self) -> ElementCounts {
        match self {
            Self::Mesh(chunk) => chunk.into(),
            Self::Points(chunk) => chunk.into(),
            Self::Curves(chunk) => chunk.into(),
        }
    }

    #[inline]
    pub(super) fn attributes(self) -> &'a [Attribute] {
        match self {
            Self::Mesh(chunk) => &chunk.attributes,
            Self::Points(chunk) => &chunk.attributes,
            Self::Curves(chunk) => &chunk.attributes,
        }
    }
}

/// Where the primitives of a prototype's chunks begin, in the order of the acceleration structure.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct PrototypeIndex {
    primitives_before: Vec<u32>,
}

impl PrototypeIndex {
    pub(super) fn new(prototype: &Prototype) -> Self {
        let mut n = 0;
        let before = chunk_sizes(prototype).map(|size| {
            let before = n;
            n += size as u32;
            before
        });
        Self {
            primitives_before: before.collect(),
        }
    }

    /// Chunk and primitive within.
    #[inline]
    fn locate(&self, primitive: u32) -> (u32, u32) {
        let before = &self.primitives_before;
        let chunk = match before.len() {
            1 => 0,
            _ => before.partition_point(|&n| n <= primitive) - 1,
        };
        (chunk as u32, primitive - before[chunk])
    }

    /// The primitive as hits count it.
    #[inline]
    pub(super) fn primitive(&self, at: PrimitiveRef) -> u32 {
        self.primitives_before[at.chunk as usize] + at.primitive
    }
}

/// Primitives of each chunk.
fn chunk_sizes(prototype: &Prototype) -> impl Iterator<Item = usize> {
    let meshes = prototype.chunks.iter().map(|c| c.triangles.len());
    let points = prototype.points.iter().map(|c| c.centers.len());
    let curves = prototype.curves.iter().map(|c| c.segments.len());
    meshes.chain(points).chain(curves)
}

impl Geometry {
    /// Which primitive was hit.
    #[inline]
    pub fn locate(&self, hit: &Hit) -> PrimitiveRef {
        let placed = &self.placements[hit.instance as usize];
        let (chunk, primitive) =
            self.outline.prototypes[placed.prototype as usize].locate(hit.primitive);
        PrimitiveRef {
            placement: hit.instance,
            chunk,
            primitive,
        }
    }

    #[inline]
    pub(super) fn chunk(&self, at: PrimitiveRef) -> Chunk<'_> {
        let prototype = self.placements[at.placement as usize].prototype;
        let prototype = &self.scene.prototypes[prototype as usize];
        let idx = at.chunk as usize;
        if let Some(mesh) = prototype.chunks.get(idx) {
            return Chunk::Mesh(mesh);
        }
        let idx = idx - prototype.chunks.len();
        match prototype.points.get(idx) {
            Some(points) => Chunk::Points(points),
            None => Chunk::Curves(&prototype.curves[idx - prototype.points.len()]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_come_first_then_points_then_curves() {
        let mesh = |n: usize| MeshChunk {
            triangles: vec![[0; 3]; n],
            ..MeshChunk::default()
        };
        let prototype = Prototype {
            chunks: vec![mesh(3), mesh(2)],
            curves: vec![CurvesChunk {
                segments: vec![0; 7],
                ..CurvesChunk::default()
            }],
            points: vec![PointsChunk {
                centers: vec![[0.0; 3]; 4],
                ..PointsChunk::default()
            }],
            ..Prototype::default()
        };
        let index = PrototypeIndex::new(&prototype);
        let found = [0, 2, 3, 4, 5, 8, 9, 15].map(|primitive| index.locate(primitive));
        let expected = [
            (0, 0),
            (0, 2),
            (1, 0),
            (1, 1),
            (2, 0),
            (2, 3),
            (3, 0),
            (3, 6),
        ];
        assert_eq!(found, expected);
    }
}
