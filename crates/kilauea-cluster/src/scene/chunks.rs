//! Chunks of a scene by themselves: what goes to those who have some of them.

use std::ops::Range;

use kilauea_scene::Scene;

use super::read::SceneReader;
use super::{SceneBytesError, write};

/// The bytes of a scene, and where its chunks are in them.
pub(crate) struct SceneChunks {
    pub(crate) bytes: Vec<u8>,
    /// By prototype and number in it: meshes come first, then points, then curves.
    ranges: Vec<Vec<Range<usize>>>,
}

impl SceneChunks {
    pub(crate) fn of(scene: &Scene) -> Self {
        let (bytes, written) = write(scene).finish();
        let mut written = written.into_iter();
        let ranges = scene.prototypes.iter().map(|prototype| {
            let mut take = |n: usize| written.by_ref().take(n).collect::<Vec<_>>();
            let meshes = take(prototype.chunks.len());
            let curves = take(prototype.curves.len());
            let points = take(prototype.points.len());
            [meshes, points, curves].concat()
        });
        Self {
            ranges: ranges.collect(),
            bytes,
        }
    }

    /// The bytes of one chunk.
    pub(crate) fn chunk(&self, prototype: u32, number: u32) -> &[u8] {
        let range = &self.ranges[prototype as usize][number as usize];
        &self.bytes[range.clone()]
    }
}

/// Puts a chunk where its scene has a husk.
pub(crate) fn put_chunk(
    scene: &mut Scene,
    prototype: u32,
    number: u32,
    bytes: &[u8],
) -> Result<(), SceneBytesError> {
    let missing = SceneBytesError::Chunk { prototype, number };
    let of = scene.prototypes.get_mut(prototype as usize);
    let Some(of) = of.filter(|of| (number as usize) < of.n_chunks()) else {
        return Err(missing);
    };
    let mut reader = SceneReader::new(bytes);
    let (n_meshes, n_points) = (of.chunks.len(), of.points.len());
    match number as usize {
        idx if idx < n_meshes => of.chunks[idx] = reader.mesh()?,
        idx if idx < n_meshes + n_points => of.points[idx - n_meshes] = reader.points()?,
        idx => of.curves[idx - n_meshes - n_points] = reader.curves()?,
    }
    reader.finish()
}
