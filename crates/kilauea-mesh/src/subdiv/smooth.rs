//! Values of the next level, and limit values. `W` floats per value.

use std::f64::consts::TAU;

use crate::tokens::{Scheme, TriangleRule};

use super::rings::limit_darts;
use super::rules::{Rule, VertexRules};
use super::split::ChildVertices;
use super::topology::{NONE, Topology};

/// Weight of the face opposite an edge, for triangles under [`TriangleRule::Smooth`]
/// (OpenSubdiv documentation, "Triangle Subdivision Rule").
const SMOOTH_TRIANGLE_WEIGHT: f32 = 0.470;

#[inline]
fn add<const W: usize>(sum: &mut [f32; W], weight: f32, value: &[f32; W]) {
    for (s, v) in sum.iter_mut().zip(value) {
        *s += weight * v;
    }
}

/// Values at the next level's vertices, by the scheme's masks.
pub(crate) fn refine<const W: usize>(
    topology: &Topology,
    rules: &[VertexRules],
    scheme: Scheme,
    triangle_rule: TriangleRule,
    values: &[[f32; W]],
) -> Vec<[f32; W]> {
    if scheme == Scheme::Bilinear {
        return refine_linear(topology, scheme, values);
    }
    let numbers = ChildVertices::new(topology, scheme);
    let mut out = Vec::with_capacity(numbers.vertices + topology.n_vertices);
    if scheme == Scheme::CatmullClark {
        push_face_points(topology, values, &mut out);
    }
    for edge in 0..topology.n_edges() {
        let [a, b] = topology.ends(edge).map(|v| &values[v as usize]);
        let mut middle = [0.0; W];
        add(&mut middle, 0.5, a);
        add(&mut middle, 0.5, b);
        let half = topology.edge_half[edge];
        let twin = topology.twin[half as usize];
        let sharpness = topology.edge_sharpness[edge];
        if sharpness >= 1.0 || twin == NONE {
            out.push(middle);
            continue;
        }
        let mut point = [0.0; W];
        match scheme {
            Scheme::Loop => {
                add(&mut point, 0.75, &middle);
                for h in [half, twin] {
                    let opposite = topology.vertex[topology.prev(h) as usize];
                    add(&mut point, 0.125, &values[opposite as usize]);
                }
            }
            Scheme::CatmullClark | Scheme::Bilinear => {
                let faces = [half, twin].map(|h| topology.face(h));
                let w = face_weight(topology, triangle_rule, faces);
                add(&mut point, 1.0 - 2.0 * w, &middle);
                for face in faces {
                    let face_point = out[face as usize];
                    add(&mut point, w, &face_point);
                }
            }
        }
        if sharpness > 0.0 {
            let smooth = point;
            point = [0.0; W];
            add(&mut point, sharpness, &middle);
            add(&mut point, 1.0 - sharpness, &smooth);
        }
        out.push(point);
    }
    let sums = Neighbours::new(topology, rules, values, |sums: &mut [[f32; W]]| {
        if scheme == Scheme::CatmullClark {
            for corner in 0..topology.n_corners() {
                let face_point = &out[topology.face(corner as u32) as usize];
                add(&mut sums[topology.vertex[corner] as usize], 1.0, face_point);
            }
        }
    });
    for v in 0..topology.n_vertices {
        let [smooth, crease, corner] = rules[v].weights(topology.vertex_sharpness[v]);
        let mut point = [0.0; W];
        add(&mut point, corner + 0.75 * crease, &values[v]);
        add(&mut point, 0.125 * crease, &sums.crease[v]);
        if smooth > 0.0 {
            let n = rules[v].n_edges;
            let (vertex, edge, face) = match scheme {
                Scheme::Loop => {
                    let beta = loop_beta(n);
                    (1.0 - n as f32 * beta, beta, 0.0)
                }
                Scheme::CatmullClark | Scheme::Bilinear => {
                    let n = n as f32;
                    ((n - 2.0) / n, 1.0 / (n * n), 1.0 / (n * n))
                }
            };
            add(&mut point, smooth * vertex, &values[v]);
            add(&mut point, smooth * edge, &sums.edges[v]);
            add(&mut point, smooth * face, &sums.faces[v]);
        }
        out.push(point);
    }
    out
}

/// Values at the next level's vertices, linear in between.
pub(crate) fn refine_linear<const W: usize>(
    topology: &Topology,
    scheme: Scheme,
    values: &[[f32; W]],
) -> Vec<[f32; W]> {
    let numbers = ChildVertices::new(topology, scheme);
    let mut out = Vec::with_capacity(numbers.vertices + topology.n_vertices);
    if scheme != Scheme::Loop {
        push_face_points(topology, values, &mut out);
    }
    out.extend((0..topology.n_edges()).map(|edge| {
        let [a, b] = topology.ends(edge).map(|v| &values[v as usize]);
        let mut middle = [0.0; W];
        add(&mut middle, 0.5, a);
        add(&mut middle, 0.5, b);
        middle
    }));
    out.extend_from_slice(values);
    out
}

/// Values on the limit surface. Catmull-Clark's are those of quads.
///
/// Smooth vertices: Halstead et al. 1993 (Catmull-Clark), Loop 1987; creases: uniform cubic
/// B-splines. Edges that are sharp at all count as creases.
pub(crate) fn limit<const W: usize>(
    topology: &Topology,
    rules: &[VertexRules],
    scheme: Scheme,
    values: &[[f32; W]],
) -> Vec<[f32; W]> {
    if scheme == Scheme::Bilinear {
        return values.to_vec();
    }
    let sums = Neighbours::new(topology, rules, values, |sums: &mut [[f32; W]]| {
        if scheme == Scheme::CatmullClark {
            for corner in 0..topology.n_corners() as u32 {
                let diagonal = topology.vertex[topology.next(topology.next(corner)) as usize];
                let vertex = topology.vertex[corner as usize];
                add(&mut sums[vertex as usize], 1.0, &values[diagonal as usize]);
            }
        }
    });
    let limit_of = |v: usize| {
        let mut point = [0.0; W];
        match rules[v].rule(topology.vertex_sharpness[v]) {
            Rule::Corner => point = values[v],
            Rule::Crease => {
                add(&mut point, 2.0 / 3.0, &values[v]);
                add(&mut point, 1.0 / 6.0, &sums.crease[v]);
            }
            Rule::Smooth => {
                let n = rules[v].n_edges as f32;
                let (edge, face) = match scheme {
                    Scheme::Loop => (1.0 / (n + 0.375 / loop_beta(rules[v].n_edges)), 0.0),
                    Scheme::CatmullClark | Scheme::Bilinear => {
                        let face = 1.0 / (n * (n + 5.0));
                        (4.0 * face, face)
                    }
                };
                add(&mut point, 1.0 - n * (edge + face), &values[v]);
                add(&mut point, edge, &sums.edges[v]);
                add(&mut point, face, &sums.faces[v]);
            }
        }
        point
    };
    let mut limits = (0..topology.n_vertices).map(limit_of).collect::<Vec<_>>();
    limit_darts(topology, rules, scheme, values, &mut limits);
    limits
}

/// Sums over the neighbours of each vertex.
struct Neighbours<const W: usize> {
    edges: Vec<[f32; W]>,
    faces: Vec<[f32; W]>,
    /// Over the two ends of the crease.
    crease: Vec<[f32; W]>,
}

impl<const W: usize> Neighbours<W> {
    fn new(
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
}

fn push_face_points<const W: usize>(
    topology: &Topology,
    values: &[[f32; W]],
    out: &mut Vec<[f32; W]>,
) {
    out.extend((0..topology.n_faces()).map(|face| {
        let corners = topology.corners(face);
        let weight = 1.0 / corners.len() as f32;
        let mut mean = [0.0; W];
        for &v in &topology.vertex[corners] {
            add(&mut mean, weight, &values[v as usize]);
        }
        mean
    }));
}

/// Weight of each of the two face points of an edge in Catmull-Clark.
fn face_weight(topology: &Topology, rule: TriangleRule, faces: [u32; 2]) -> f32 {
    if rule == TriangleRule::CatmullClark {
        return 0.25;
    }
    let weights = faces.map(|f| {
        if topology.corners(f as usize).len() == 3 {
            SMOOTH_TRIANGLE_WEIGHT
        } else {
            0.25
        }
    });
    0.5 * (weights[0] + weights[1])
}

/// Loop's weight of each neighbour of a smooth vertex.
pub(crate) fn loop_beta(n_edges: u32) -> f32 {
    let n = f64::from(n_edges);
    let center = 0.375 + 0.25 * (TAU / n).cos();
    ((0.625 - center * center) / n) as f32
}
