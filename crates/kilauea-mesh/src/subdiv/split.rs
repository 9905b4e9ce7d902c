use crate::tokens::Scheme;

use super::topology::{INFINITELY_SHARP, Layout, NONE, Topology};

/// Where the vertices of the next level come from: `faces`, then `edges`, then `vertices`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChildVertices {
    /// First vertex in the middle of an edge.
    pub(crate) edges: usize,
    /// First vertex near a vertex.
    pub(crate) vertices: usize,
}

impl ChildVertices {
    pub(crate) fn new(parent: &Topology, scheme: Scheme) -> Self {
        let edges = match scheme {
            Scheme::CatmullClark | Scheme::Bilinear => parent.n_faces(),
            Scheme::Loop => 0,
        };
        Self {
            edges,
            vertices: edges + parent.n_edges(),
        }
    }
}

/// What is left of a sharpness one level down.
pub(crate) fn child_sharpness(sharpness: f32) -> f32 {
    if sharpness >= INFINITELY_SHARP {
        sharpness
    } else {
        (sharpness - 1.0).max(0.0)
    }
}

/// The next level: a quad per corner, or four triangles per triangle.
pub(crate) fn split(parent: &Topology, scheme: Scheme) -> Topology {
    let numbers = ChildVertices::new(parent, scheme);
    let n_halves = 4 * parent.n_corners();
    let n_inner_edges = parent.n_corners();
    let mut child = Topology {
        n_vertices: numbers.vertices + parent.n_vertices,
        layout: match scheme {
            Scheme::CatmullClark | Scheme::Bilinear => Layout::Quads,
            Scheme::Loop => Layout::Triangles,
        },
        vertex: Vec::with_capacity(n_halves),
        twin: Vec::with_capacity(n_halves),
        edge: Vec::with_capacity(n_halves),
        edge_half: Vec::with_capacity(2 * parent.n_edges() + n_inner_edges),
        edge_sharpness: Vec::with_capacity(2 * parent.n_edges() + n_inner_edges),
        vertex_sharpness: vec![0.0; numbers.vertices],
    };
    let sharpness = parent.vertex_sharpness.iter().copied();
    child
        .vertex_sharpness
        .extend(sharpness.map(child_sharpness));
    for &sharpness in &parent.edge_sharpness {
        child.edge_sharpness.extend([child_sharpness(sharpness); 2]);
    }
    child
        .edge_sharpness
        .resize(2 * parent.n_edges() + n_inner_edges, 0.0);
    match scheme {
        Scheme::CatmullClark | Scheme::Bilinear => quads(parent, numbers, &mut child),
        Scheme::Loop => triangles(parent, numbers, &mut child),
    }
    child
}

/// The halves of an edge are numbered from the start of the edge's own half-edge; this is the
/// first half along `half`.
fn first_half(parent: &Topology, half: u32) -> u32 {
    let edge = parent.edge[half as usize];
    let start = parent.vertex[parent.edge_half[edge as usize] as usize];
    2 * edge + u32::from(parent.vertex[half as usize] != start)
}

/// Quad `c` has corner `c`, the middle of its half-edge, the middle of its face, and the middle
/// of the half-edge before. Inner edge `c` goes from the middle of half-edge `c` to the face's.
fn quads(parent: &Topology, numbers: ChildVertices, child: &mut Topology) {
    let n_halved = 2 * parent.n_edges() as u32;
    for c in 0..parent.n_corners() as u32 {
        let (prev, next) = (parent.prev(c), parent.next(c));
        let middle = |half: u32| numbers.edges as u32 + parent.edge[half as usize];
        child.vertex.extend([
            numbers.vertices as u32 + parent.vertex[c as usize],
            middle(c),
            parent.face(c),
            middle(prev),
        ]);
        child.twin.extend([
            parent.beyond(c).map_or(NONE, |t| 4 * parent.next(t) + 3),
            4 * next + 2,
            4 * prev + 1,
            parent.beyond(prev).map_or(NONE, |t| 4 * t),
        ]);
        child.edge.extend([
            first_half(parent, c),
            n_halved + c,
            n_halved + prev,
            first_half(parent, prev) ^ 1,
        ]);
    }
    for &half in &parent.edge_half {
        child
            .edge_half
            .extend([4 * half, 4 * parent.next(half) + 3]);
    }
    let inner = (0..parent.n_corners() as u32).map(|c| 4 * c + 1);
    child.edge_half.extend(inner);
}

/// Triangle `4f + k` is at corner `k` of triangle `f`, `4f + 3` in the middle; inner edge
/// `3f + k` goes from the middle of half-edge `k` to that of half-edge `k + 1`.
fn triangles(parent: &Topology, numbers: ChildVertices, child: &mut Topology) {
    let n_halved = 2 * parent.n_edges() as u32;
    // First half-edge of the triangle at a corner.
    let at_corner = |c: u32| 3 * (4 * (c / 3) + c % 3);
    let middle = |half: u32| numbers.edges as u32 + parent.edge[half as usize];
    for face in 0..parent.n_faces() as u32 {
        let first_inner = 3 * (4 * face + 3);
        for k in 0..3 {
            let c = 3 * face + k;
            let prev = parent.prev(c);
            child.vertex.extend([
                numbers.vertices as u32 + parent.vertex[c as usize],
                middle(c),
                middle(prev),
            ]);
            child.twin.extend([
                parent
                    .beyond(c)
                    .map_or(NONE, |t| at_corner(parent.next(t)) + 2),
                first_inner + prev % 3,
                parent.beyond(prev).map_or(NONE, at_corner),
            ]);
            child.edge.extend([
                first_half(parent, c),
                n_halved + prev,
                first_half(parent, prev) ^ 1,
            ]);
        }
        for k in 0..3 {
            let c = 3 * face + k;
            child.vertex.push(middle(c));
            child.twin.push(at_corner(parent.next(c)) + 1);
            child.edge.push(n_halved + c);
        }
    }
    for &half in &parent.edge_half {
        child
            .edge_half
            .extend([at_corner(half), at_corner(parent.next(half)) + 2]);
    }
    let inner = (0..parent.n_corners() as u32).map(|c| 3 * (4 * (c / 3) + 3) + c % 3);
    child.edge_half.extend(inner);
}
