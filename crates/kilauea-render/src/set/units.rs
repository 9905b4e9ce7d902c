//! The pieces that are placed on members.
//!
//! A unit is a chunk of a prototype, with all placements of it. Chunks are what scenes are made of:
//! compact in space, of one material, and bounded in size, so that no unit is too large for a member
//! because a mesh is. A part of a prototype goes with its placements, as a placement takes a few
//! hundred bytes and the part may take millions; to spread placements instead would copy it to
//! every member.

use kilauea_math::Bounds3;
use kilauea_scene::{CurvesChunk, PointsChunk, Prototype, Scene};

use super::pieces::piece_bounds;
use crate::geometry::ChunkId;

/// A chunk that is to be placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Unit {
    pub(super) id: ChunkId,
    /// Of its arrays, and of the trees over them as far as that is known beforehand.
    pub(super) bytes: u64,
}

/// Bytes of trees to a triangle: four pairs in 256 bytes of a leaf, half full or more, and nodes of
/// 256 bytes over up to eight.
const TREE_BYTES_PER_TRIANGLE: u64 = 64;
/// To a sphere or a segment, which is cut into pieces.
const TREE_BYTES_PER_SPHERE: u64 = 64;
const TREE_BYTES_PER_SEGMENT: u64 = 512;

/// All units of a scene, by prototype and chunk.
pub(super) fn units(scene: &Scene) -> Vec<Unit> {
    (0..)
        .zip(&scene.prototypes)
        .flat_map(|(prototype, of)| {
            let bytes = chunk_bytes(of).into_iter();
            (0..).zip(bytes).map(move |(chunk, bytes)| Unit {
                id: ChunkId { prototype, chunk },
                bytes,
            })
        })
        .collect()
}

/// By chunk: meshes, then points, then curves.
pub(super) fn chunk_bytes(prototype: &Prototype) -> Vec<u64> {
    let meshes = prototype.chunks.iter().map(|c| {
        let tree = TREE_BYTES_PER_TRIANGLE * c.triangles.len() as u64;
        // A tree for each interval between motion keys.
        c.n_bytes() as u64 + tree * c.later_keys.len().max(1) as u64
    });
    let points = prototype.points.iter().map(|c| {
        let tree = TREE_BYTES_PER_SPHERE * c.centers.len() as u64;
        c.n_bytes() as u64 + tree * c.later_centers.len().max(1) as u64
    });
    let curves = prototype.curves.iter().map(|c| {
        let tree = TREE_BYTES_PER_SEGMENT * c.segments.len() as u64;
        c.n_bytes() as u64 + tree * c.later_points.len().max(1) as u64
    });
    meshes.chain(points).chain(curves).collect()
}

/// Boxes around pieces of chunks at all times, in the chunks' space, by chunk in the same order.
pub(super) fn chunk_bounds(prototype: &Prototype) -> Vec<Vec<Bounds3>> {
    let meshes = prototype.chunks.iter().map(piece_bounds);
    let points = prototype.points.iter().map(PointsChunk::bounds);
    let curves = prototype.curves.iter().map(CurvesChunk::bounds);
    let others = points.chain(curves).map(|bounds| vec![bounds]);
    meshes.chain(others).collect()
}
