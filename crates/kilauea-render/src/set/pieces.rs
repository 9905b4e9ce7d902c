//! Boxes around pieces of a chunk: a chunk is large, and what a ray does not pierce is not asked for.

use kilauea_math::{Bounds3, Vec3};
use kilauea_scene::MeshChunk;

/// Pieces of a chunk, at most. A ray asks for fewer members the more there are, and takes longer to see
/// that.
const MOST_PIECES: usize = 32;
/// Triangles of a piece, at least.
const LEAST_TRIANGLES: usize = 16;

/// Boxes around pieces of a chunk at all times, compact and of about as many triangles each; none
/// where there are no triangles.
pub(super) fn piece_bounds(chunk: &MeshChunk) -> Vec<Bounds3> {
    let later = chunk.later_keys.iter().map(|key| &key.positions);
    let keys: Vec<_> = std::iter::once(&chunk.positions).chain(later).collect();
    let bounds_of = |triangle: &[u32; 3]| {
        let corners = keys.iter().flat_map(|positions| {
            triangle.map(|vertex| Vec3::from_array(positions[vertex as usize]))
        });
        Bounds3::from_points(corners)
    };
    let mut triangles: Vec<Bounds3> = chunk.triangles.iter().map(bounds_of).collect();
    let n_pieces = MOST_PIECES.min(triangles.len().div_ceil(LEAST_TRIANGLES));
    let mut pieces = Vec::with_capacity(n_pieces);
    split(&mut triangles, n_pieces, &mut pieces);
    pieces
}

/// Halves boxes by the longest axis of their centers, until there are so many pieces.
fn split(boxes: &mut [Bounds3], n_pieces: usize, pieces: &mut Vec<Bounds3>) {
    if n_pieces <= 1 {
        let union = boxes.iter().copied().reduce(|a, b| a.union(&b));
        pieces.extend(union);
        return;
    }
    let extent = Bounds3::from_points(boxes.iter().map(Bounds3::center)).diagonal();
    let axis = extent.max_position();
    let n_left = n_pieces / 2;
    let middle = boxes.len() * n_left / n_pieces;
    boxes.select_nth_unstable_by(middle, |a, b| a.center()[axis].total_cmp(&b.center()[axis]));
    let (left, right) = boxes.split_at_mut(middle);
    split(left, n_left, pieces);
    split(right, n_pieces - n_left, pieces);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of triangles along the first axis, in an order by chance, that rise with the second key.
    fn row(n: u32) -> MeshChunk {
        let order = |i: u32| (i * 7) % n;
        let corner = |i: u32, v: usize| {
            let x = order(i) as f32;
            [[x, 0.0, 0.0], [x + 0.5, 0.0, 0.0], [x, 0.5, 0.0]][v]
        };
        let positions: Vec<[f32; 3]> = (0..n)
            .flat_map(|i| (0..3).map(move |v| corner(i, v)))
            .collect();
        let raised = positions.iter().map(|p| [p[0], p[1], 2.0]).collect();
        MeshChunk {
            positions,
            triangles: (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            later_keys: vec![kilauea_scene::MeshKey {
                positions: raised,
                normals: None,
            }],
            ..MeshChunk::default()
        }
    }

    #[test]
    fn pieces_hold_all_triangles_and_little_else() {
        for (n, n_pieces) in [(1, 1), (20, 2), (5000, MOST_PIECES)] {
            let chunk = row(n);
            let pieces = piece_bounds(&chunk);
            assert_eq!(pieces.len(), n_pieces);
            let all = pieces.iter().copied().reduce(|a, b| a.union(&b));
            assert_eq!(all, Some(chunk.bounds()));
            let length: f32 = pieces.iter().map(|piece| piece.diagonal().x).sum();
            assert!(length <= chunk.bounds().diagonal().x, "they overlap");
        }
        assert!(piece_bounds(&MeshChunk::default()).is_empty());
    }
}
