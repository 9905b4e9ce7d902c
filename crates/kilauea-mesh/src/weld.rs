/// Stands for no vertex.
const NONE: u32 = u32::MAX;

/// Gives corners that share a point and all their data the same vertex.
///
/// The vertices of one point form a list; a corner takes the first that is the same, or makes one.
/// The table over all points is kept between pieces of a mesh.
pub(crate) struct Welder {
    /// First vertex of each point.
    head: Vec<u32>,
    /// The point's next vertex, by vertex.
    next: Vec<u32>,
    /// Point of each vertex.
    points: Vec<u32>,
    /// The corner that made each vertex.
    corners: Vec<u32>,
}

impl Welder {
    pub(crate) fn new(n_points: usize) -> Self {
        Self {
            head: vec![NONE; n_points],
            next: Vec::new(),
            points: Vec::new(),
            corners: Vec::new(),
        }
    }

    /// The vertex of a corner; `same` compares the data of two corners of this point.
    #[inline]
    pub(crate) fn vertex(
        &mut self,
        point: u32,
        corner: u32,
        mut same: impl FnMut(u32, u32) -> bool,
    ) -> u32 {
        let mut vertex = self.head[point as usize];
        while vertex != NONE {
            if same(self.corners[vertex as usize], corner) {
                return vertex;
            }
            vertex = self.next[vertex as usize];
        }
        let vertex = self.points.len() as u32;
        self.next.push(self.head[point as usize]);
        self.head[point as usize] = vertex;
        self.points.push(point);
        self.corners.push(corner);
        vertex
    }

    /// Point of each vertex.
    pub(crate) fn points(&self) -> &[u32] {
        &self.points
    }

    /// A corner that has each vertex.
    pub(crate) fn corners(&self) -> &[u32] {
        &self.corners
    }

    /// Forgets all vertices, in time proportional to their number.
    pub(crate) fn clear(&mut self) {
        for &point in &self.points {
            self.head[point as usize] = NONE;
        }
        self.next.clear();
        self.points.clear();
        self.corners.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_share_a_vertex_only_with_the_same_data() {
        let points = [0, 1, 0, 0, 1];
        let data = ['a', 'a', 'b', 'a', 'a'];
        let mut welder = Welder::new(2);
        for _ in 0..2 {
            let vertices: Vec<u32> = (0..5_u32)
                .map(|c| {
                    welder.vertex(points[c as usize], c, |a, b| {
                        data[a as usize] == data[b as usize]
                    })
                })
                .collect();
            assert_eq!(vertices, [0, 1, 2, 0, 1]);
            assert_eq!(welder.points(), [0, 1, 0]);
            assert_eq!(welder.corners(), [0, 1, 2]);
            welder.clear();
        }
    }
}
