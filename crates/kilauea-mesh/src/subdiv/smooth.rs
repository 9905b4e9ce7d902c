//! Values of the next level; `W` floats per value.

use rayon::prelude::*;

use crate::tokens::{Scheme, TriangleRule};

use super::neighbours::{MIN_PER_TASK, Neighbours, add, loop_beta};
use super::rules::VertexRules;
use super::split::ChildVertices;
use super::topology::Topology;

/// Weight of the face opposite an edge, for triangles under [`TriangleRule::Smooth`]
/// (OpenSubdiv documentation, "Triangle Subdivision Rule").
const SMOOTH_TRIANGLE_WEIGHT: f32 = 0.470;

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
    let mut faces = Vec::new();
    if scheme == Scheme::CatmullClark {
        let numbers = ChildVertices::new(topology, scheme);
        faces.reserve_exact(numbers.vertices + topology.n_vertices);
        push_face_points(topology, values, &mut faces);
    }
    let sums = Neighbours::new(topology, rules, values, |sums: &mut [[f32; W]]| {
        if scheme == Scheme::CatmullClark {
            for corner in 0..topology.n_corners() {
                let face_point = &faces[topology.face(corner as u32) as usize];
                add(&mut sums[topology.vertex[corner] as usize], 1.0, face_point);
            }
        }
    });
    let edges: Vec<[f32; W]> = (0..topology.n_edges())
        .into_par_iter()
        .with_min_len(MIN_PER_TASK)
        .map(|edge| edge_point(topology, triangle_rule, edge, values, &faces))
        .collect();
    let vertices: Vec<[f32; W]> = (0..topology.n_vertices)
        .into_par_iter()
        .with_min_len(MIN_PER_TASK)
        .map(|v| {
            vertex_point(
                rules[v],
                topology.vertex_sharpness[v],
                scheme,
                &values[v],
                sums.at(v),
            )
        })
        .collect();
    let mut out = faces;
    out.extend(edges);
    out.extend(vertices);
    out
}

/// Where an edge is split: its middle if sharp, else by the faces beside it too. Loop has no
/// `faces`.
fn edge_point<const W: usize>(
    topology: &Topology,
    triangle_rule: TriangleRule,
    edge: usize,
    values: &[[f32; W]],
    faces: &[[f32; W]],
) -> [f32; W] {
    let middle = middle(topology, edge, values);
    let half = topology.edge_half[edge];
    let sharpness = topology.edge_sharpness[edge];
    let Some(twin) = topology.beyond(half).filter(|_| sharpness < 1.0) else {
        return middle;
    };
    let mut smooth = [0.0; W];
    if faces.is_empty() {
        add(&mut smooth, 0.75, &middle);
        for h in [half, twin] {
            let opposite = topology.vertex[topology.prev(h) as usize];
            add(&mut smooth, 0.125, &values[opposite as usize]);
        }
    } else {
        let beside = [half, twin].map(|h| topology.face(h));
        let weight = face_weight(topology, triangle_rule, beside);
        add(&mut smooth, 1.0 - 2.0 * weight, &middle);
        for face in beside {
            add(&mut smooth, weight, &faces[face as usize]);
        }
    }
    if sharpness <= 0.0 {
        return smooth;
    }
    let mut point = [0.0; W];
    add(&mut point, sharpness, &middle);
    add(&mut point, 1.0 - sharpness, &smooth);
    point
}

/// Where a vertex goes.
fn vertex_point<const W: usize>(
    rules: VertexRules,
    sharpness: f32,
    scheme: Scheme,
    value: &[f32; W],
    [edges, faces, crease_ends]: [&[f32; W]; 3],
) -> [f32; W] {
    let [smooth, crease, corner] = rules.weights(sharpness);
    let mut point = [0.0; W];
    add(&mut point, corner + 0.75 * crease, value);
    add(&mut point, 0.125 * crease, crease_ends);
    if smooth > 0.0 {
        let n = rules.n_edges as f32;
        let (vertex, edge, face) = match scheme {
            Scheme::Loop => {
                let beta = loop_beta(rules.n_edges);
                (1.0 - n * beta, beta, 0.0)
            }
            Scheme::CatmullClark | Scheme::Bilinear => {
                ((n - 2.0) / n, 1.0 / (n * n), 1.0 / (n * n))
            }
        };
        add(&mut point, smooth * vertex, value);
        add(&mut point, smooth * edge, edges);
        add(&mut point, smooth * face, faces);
    }
    point
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
    out.extend((0..topology.n_edges()).map(|edge| middle(topology, edge, values)));
    out.extend_from_slice(values);
    out
}

fn middle<const W: usize>(topology: &Topology, edge: usize, values: &[[f32; W]]) -> [f32; W] {
    let [a, b] = topology.ends(edge).map(|v| &values[v as usize]);
    std::array::from_fn(|i| 0.5 * a[i] + 0.5 * b[i])
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
