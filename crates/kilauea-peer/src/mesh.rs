use kilauea_math::{Bounds3, Vec3};

use crate::PeerError;

/// Triangles that all tracers share without copying them.
#[derive(Clone, Debug)]
pub struct TriangleMesh {
    /// The vertices, and one more: Embree reads vertices as 16 bytes, past the end of the last.
    padded_positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl TriangleMesh {
    /// Checks the indices; `name` is for the error.
    pub fn new(
        name: &str,
        mut positions: Vec<[f32; 3]>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self, PeerError> {
        let n_vertices = positions.len();
        if triangles.is_empty() {
            return Err(PeerError::Empty { mesh: name.into() });
        }
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= n_vertices) {
                return Err(PeerError::Index {
                    mesh: name.into(),
                    triangle,
                    vertex,
                    n_vertices,
                });
            }
        }
        positions.push([0.0; 3]);
        Ok(Self {
            padded_positions: positions,
            triangles,
        })
    }

    /// The vertices.
    pub fn positions(&self) -> &[[f32; 3]] {
        &self.padded_positions[..self.padded_positions.len() - 1]
    }

    /// Indices of the three vertices of each triangle, all within range.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The corners of a triangle.
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize]
            .map(|v| Vec3::from_array(self.padded_positions[v as usize]))
    }

    /// The box around all vertices that are finite.
    pub fn bounds(&self) -> Bounds3 {
        let points = self.positions().iter().copied().map(Vec3::from_array);
        Bounds3::from_points(points.filter(|p| p.is_finite()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_indices_out_of_range_and_nothing_to_hit() {
        let positions = vec![[0.0; 3]; 3];
        let error = TriangleMesh::new("m", positions.clone(), vec![[0, 1, 2], [0, 3, 1]]);
        let text = error.expect_err("vertex 3 does not exist").to_string();
        assert_eq!(text, "m: triangle 1 has vertex 3 of 3");
        assert!(TriangleMesh::new("m", positions, Vec::new()).is_err());
    }

    #[test]
    fn the_padding_is_no_vertex() {
        let positions = vec![[1.0, 2.0, 3.0], [2.0, 2.0, 3.0], [1.0, 4.0, 3.0]];
        let mesh = TriangleMesh::new("m", positions.clone(), vec![[0, 1, 2]]).expect("valid");
        assert_eq!(mesh.positions(), positions);
        assert_eq!(mesh.bounds().min, Vec3::new(1.0, 2.0, 3.0));
    }
}
