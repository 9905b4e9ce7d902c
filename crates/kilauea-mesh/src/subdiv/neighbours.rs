//! What the masks of a vertex read; `W` floats per value.

use std::f64::consts::TAU;

use super::rules::VertexRules;
use super::topology::Topology;

/// Points that are worth a task of their own.
pub(crate) const MIN_PER_TASK: usize = 16_384;

#[inline]
pub(crate) fn add<const W: usize>(sum: &mut [f32; W], weight: f32, value: &[f32; W]) {
    for (s, v) in sum.iter_mut().zip(value) {
        *s += weight * v;
    }
}

/// Sums over the neighbours of each vertex.
pub(crate) struct Neighbours<const W: usize> {
    edges: Vec<[f32; W]>,
    faces: Vec<[f32; W]>,
    /// Over the two ends of the crease.
    crease: Vec<[f32; W]>,
}

impl<const W: usize> Neighbours<W> {
    pub(crate) fn new(
        topology: &Topology,
        rules: &[VertexRules],
        values: &[[f32; W]],
        add_faces: impl Fn(&mut [[f32; W]]),
    ) -> Self {
        let zeros = || vec![[0.0; W]; topology.n_vertices];
        let mut sums = Self {
            edges: zeros(),
            faces: zeros(),
            crease: zeros(),
        };
        for edge in 0..topology.n_edges() {
            let sharpness = topology.edge_sharpness[edge];
            let [a, b] = topology.ends(edge).map(|v| v as usize);
            for (v, other) in [(a, b), (b, a)] {
                add(&mut sums.edges[v], 1.0, &values[other]);
                if sharpness > 0.0 && rules[v].is_crease_edge(sharpness) {
                    add(&mut sums.crease[v], 1.0, &values[other]);
                }
            }
        }
        add_faces(&mut sums.faces);
        sums
    }

    /// Sums over the edges, the faces, and the crease of a vertex.
    pub(crate) fn at(&self, v: usize) -> [&[f32; W]; 3] {
        [&self.edges[v], &self.faces[v], &self.crease[v]]
    }
}

/// Loop's weight of each neighbour of a smooth vertex.
pub(crate) fn loop_beta(n_edges: u32) -> f32 {
    let n = f64::from(n_edges);
    let center = 0.375 + 0.25 * (TAU / n).cos();
    ((0.625 - center * center) / n) as f32
}
