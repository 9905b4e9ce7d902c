//! Values on the limit surface; `W` floats per value.

use rayon::prelude::*;

use crate::tokens::Scheme;

use super::neighbours::{MIN_PER_TASK, Neighbours, add, loop_beta};
use super::rings::limit_darts;
use super::rules::{Rule, VertexRules};
use super::topology::Topology;

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
    let mut limits: Vec<[f32; W]> = (0..topology.n_vertices)
        .into_par_iter()
        .with_min_len(MIN_PER_TASK)
        .map(|v| {
            limit_point(
                rules[v],
                topology.vertex_sharpness[v],
                scheme,
                &values[v],
                sums.at(v),
            )
        })
        .collect();
    limit_darts(topology, rules, scheme, values, &mut limits);
    limits
}

fn limit_point<const W: usize>(
    rules: VertexRules,
    sharpness: f32,
    scheme: Scheme,
    value: &[f32; W],
    [edges, faces, crease_ends]: [&[f32; W]; 3],
) -> [f32; W] {
    let mut point = [0.0; W];
    match rules.rule(sharpness) {
        Rule::Corner => point = *value,
        Rule::Crease => {
            add(&mut point, 2.0 / 3.0, value);
            add(&mut point, 1.0 / 6.0, crease_ends);
        }
        Rule::Smooth => {
            let n = rules.n_edges as f32;
            let (edge, face) = match scheme {
                Scheme::Loop => (1.0 / (n + 0.375 / loop_beta(rules.n_edges)), 0.0),
                Scheme::CatmullClark | Scheme::Bilinear => {
                    let face = 1.0 / (n * (n + 5.0));
                    (4.0 * face, face)
                }
            };
            add(&mut point, 1.0 - n * (edge + face), value);
            add(&mut point, edge, edges);
            add(&mut point, face, faces);
        }
    }
    point
}
