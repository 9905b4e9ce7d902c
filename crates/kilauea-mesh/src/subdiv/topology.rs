/// Stands for no half-edge.
pub(crate) const NONE: u32 = u32::MAX;

/// Edges and vertices of this sharpness stay sharp forever (UsdGeomMesh `SHARPNESS_INFINITE`).
pub(crate) const INFINITELY_SHARP: f32 = 10.0;

/// A half-edge mesh with sharpness.
///
/// Half-edge `h` starts at corner `h` and ends at the next corner of its face.
#[derive(Clone, Debug)]
pub(crate) struct Topology {
    pub(crate) n_vertices: usize,
    pub(crate) layout: Layout,
    /// Vertex that each half-edge starts at.
    pub(crate) vertex: Vec<u32>,
    /// The half-edge back, in the face beyond; [`NONE`] at boundaries and non-manifold edges.
    pub(crate) twin: Vec<u32>,
    /// Edge of each half-edge.
    pub(crate) edge: Vec<u32>,
    /// One of the half-edges of each edge.
    pub(crate) edge_half: Vec<u32>,
    pub(crate) edge_sharpness: Vec<f32>,
    pub(crate) vertex_sharpness: Vec<f32>,
}

/// Which corners make a face.
#[derive(Clone, Debug)]
pub(crate) enum Layout {
    Triangles,
    Quads,
    Polygons {
        /// First corner of each face, and the end of the last.
        first: Vec<u32>,
        /// Face of each corner.
        face: Vec<u32>,
    },
}

impl Topology {
    pub(crate) fn n_corners(&self) -> usize {
        self.vertex.len()
    }

    pub(crate) fn n_edges(&self) -> usize {
        self.edge_half.len()
    }

    pub(crate) fn n_faces(&self) -> usize {
        match &self.layout {
            Layout::Triangles => self.n_corners() / 3,
            Layout::Quads => self.n_corners() / 4,
            Layout::Polygons { first, .. } => first.len() - 1,
        }
    }

    /// Corners of a face.
    #[inline]
    pub(crate) fn corners(&self, face: usize) -> std::ops::Range<usize> {
        match &self.layout {
            Layout::Triangles => 3 * face..3 * face + 3,
            Layout::Quads => 4 * face..4 * face + 4,
            Layout::Polygons { first, .. } => first[face] as usize..first[face + 1] as usize,
        }
    }

    /// Face of a corner.
    #[inline]
    pub(crate) fn face(&self, corner: u32) -> u32 {
        match &self.layout {
            Layout::Triangles => corner / 3,
            Layout::Quads => corner / 4,
            Layout::Polygons { face, .. } => face[corner as usize],
        }
    }

    #[inline]
    pub(crate) fn next(&self, corner: u32) -> u32 {
        match &self.layout {
            Layout::Triangles if corner % 3 == 2 => corner - 2,
            Layout::Triangles => corner + 1,
            Layout::Quads => (corner & !3) | ((corner + 1) & 3),
            Layout::Polygons { .. } => {
                let range = self.corners(self.face(corner) as usize);
                if corner as usize + 1 == range.end {
                    range.start as u32
                } else {
                    corner + 1
                }
            }
        }
    }

    #[inline]
    pub(crate) fn prev(&self, corner: u32) -> u32 {
        match &self.layout {
            Layout::Triangles if corner.is_multiple_of(3) => corner + 2,
            Layout::Triangles => corner - 1,
            Layout::Quads => (corner & !3) | ((corner + 3) & 3),
            Layout::Polygons { .. } => {
                let range = self.corners(self.face(corner) as usize);
                if corner as usize == range.start {
                    range.end as u32 - 1
                } else {
                    corner - 1
                }
            }
        }
    }

    /// The half-edge back, in the face beyond.
    #[inline]
    pub(crate) fn beyond(&self, half: u32) -> Option<u32> {
        let twin = self.twin[half as usize];
        (twin != NONE).then_some(twin)
    }

    /// The two ends of an edge.
    #[inline]
    pub(crate) fn ends(&self, edge: usize) -> [u32; 2] {
        let h = self.edge_half[edge];
        [self.vertex[h as usize], self.vertex[self.next(h) as usize]]
    }

    /// Visits each run of faces around a vertex that are joined by edges: its corners
    /// counter-clockwise, and whether the run closes.
    pub(crate) fn for_each_fan(&self, mut visit: impl FnMut(&[u32], bool)) {
        let mut seen = vec![false; self.n_corners()];
        let mut fan = Vec::new();
        for corner in 0..self.n_corners() as u32 {
            if seen[corner as usize] {
                continue;
            }
            let (first, is_closed) = self.fan_start(corner);
            fan.clear();
            let mut at = first;
            loop {
                seen[at as usize] = true;
                fan.push(at);
                at = self.twin[self.prev(at) as usize];
                if at == NONE || at == first {
                    break;
                }
            }
            visit(&fan, is_closed);
        }
    }

    /// The most clockwise corner of a fan, or the corner itself where the fan closes.
    fn fan_start(&self, corner: u32) -> (u32, bool) {
        let mut at = corner;
        loop {
            let twin = self.twin[at as usize];
            if twin == NONE {
                return (at, false);
            }
            at = self.next(twin);
            if at == corner {
                return (corner, true);
            }
        }
    }
}
