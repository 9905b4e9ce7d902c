use crate::channel::Channel;
use crate::tokens::FaceVaryingRule;
use crate::weld::Welder;

use super::cage::Cage;
use super::topology::{INFINITELY_SHARP, NONE, Topology};

/// Face-varying data as a surface of its own: its vertices are the distinct values at each
/// vertex of the cage, and it has boundaries along seams.
pub(crate) struct ValueSurface {
    pub(crate) topology: Topology,
    /// A mesh corner that has each value.
    pub(crate) corners: Vec<u32>,
}

/// Cuts the cage along the seams of a channel and sharpens what the rule says
/// (OpenSubdiv documentation, "Face-Varying Interpolation Rules").
pub(crate) fn cut_along_seams(
    cage: &Cage,
    channel: &Channel<'_>,
    rule: FaceVaryingRule,
) -> ValueSurface {
    let uncut = &cage.topology;
    let mut welder = Welder::new(uncut.n_vertices);
    let vertex: Vec<u32> = uncut
        .vertex
        .iter()
        .zip(&cage.source_corners)
        .map(|(&v, &corner)| welder.vertex(v, corner, |a, b| channel.same(a, b)))
        .collect();
    let n_values = welder.points().len();
    let mut topology = Topology {
        n_vertices: n_values,
        layout: uncut.layout.clone(),
        vertex,
        twin: uncut.twin.clone(),
        edge: vec![0; uncut.n_corners()],
        edge_half: Vec::with_capacity(uncut.n_edges()),
        edge_sharpness: Vec::with_capacity(uncut.n_edges()),
        vertex_sharpness: welder
            .points()
            .iter()
            .map(|&v| uncut.vertex_sharpness[v as usize])
            .collect(),
    };
    for h in 0..uncut.n_corners() as u32 {
        let twin = uncut.twin[h as usize];
        if twin == NONE {
            continue;
        }
        let start = |half: u32| topology.vertex[half as usize];
        let is_joined = start(h) == start(uncut.next(twin)) && start(uncut.next(h)) == start(twin);
        if !is_joined {
            topology.twin[h as usize] = NONE;
        }
    }
    for h in 0..uncut.n_corners() {
        let twin = topology.twin[h];
        if twin != NONE && (twin as usize) < h {
            topology.edge[h] = topology.edge[twin as usize];
            continue;
        }
        topology.edge[h] = topology.edge_half.len() as u32;
        topology.edge_half.push(h as u32);
        topology.edge_sharpness.push(if twin == NONE {
            INFINITELY_SHARP
        } else {
            uncut.edge_sharpness[uncut.edge[h] as usize]
        });
    }
    let spans = Spans::new(uncut, &topology, welder.points());
    for (v, values) in spans.values.iter().enumerate() {
        sharpen_values(v, values, &spans, rule, uncut, &mut topology);
    }
    ValueSurface {
        topology,
        corners: welder.corners().to_vec(),
    }
}

/// What lies around the vertices of the cage and around the values there.
struct Spans {
    /// Values at each vertex.
    values: Vec<Vec<u32>>,
    /// Whether each vertex lies on the boundary of the cage.
    is_boundary: Vec<bool>,
    /// Faces around each value.
    n_faces: Vec<u32>,
    /// Connected runs of them.
    n_fans: Vec<u32>,
    /// Whether each value lies on a seam or boundary.
    is_cut: Vec<bool>,
    /// Edges at each value that stay sharp.
    n_sharp: Vec<u32>,
}

impl Spans {
    fn new(uncut: &Topology, cut: &Topology, vertex_of_value: &[u32]) -> Self {
        let n_values = cut.n_vertices;
        let mut spans = Self {
            values: vec![Vec::new(); uncut.n_vertices],
            is_boundary: vec![false; uncut.n_vertices],
            n_faces: vec![0; n_values],
            n_fans: vec![0; n_values],
            is_cut: vec![false; n_values],
            n_sharp: vec![0; n_values],
        };
        for (value, &v) in vertex_of_value.iter().enumerate() {
            spans.values[v as usize].push(value as u32);
        }
        uncut.for_each_fan(|fan, is_closed| {
            spans.is_boundary[uncut.vertex[fan[0] as usize] as usize] |= !is_closed;
        });
        cut.for_each_fan(|fan, is_closed| {
            let value = cut.vertex[fan[0] as usize] as usize;
            spans.n_faces[value] += fan.len() as u32;
            spans.n_fans[value] += 1;
            spans.is_cut[value] |= !is_closed;
        });
        for edge in 0..cut.n_edges() {
            if cut.edge_sharpness[edge] >= INFINITELY_SHARP {
                for value in cut.ends(edge) {
                    spans.n_sharp[value as usize] += 1;
                }
            }
        }
        spans
    }

    /// Faces in several runs, or with an edge inside that is as sharp as a seam.
    fn is_disjoint(&self, value: u32) -> bool {
        self.n_fans[value as usize] > 1 || self.n_sharp[value as usize] > 2
    }
}

/// Makes corners of the values at a vertex that the rule keeps in place.
fn sharpen_values(
    vertex: usize,
    values: &[u32],
    spans: &Spans,
    rule: FaceVaryingRule,
    uncut: &Topology,
    cut: &mut Topology,
) {
    use FaceVaryingRule as F;
    let is_cut = |&value: &u32| spans.is_cut[value as usize];
    if !values.iter().any(is_cut) {
        return;
    }
    let is_boundary = spans.is_boundary[vertex];
    // A seam ends here, or several regions meet.
    let is_seam = values.len() > 1 || !is_boundary;
    let is_one_face = |&value: &u32| spans.n_faces[value as usize] == 1;
    let depends_on_others = matches!(rule, F::CornersPlus1 | F::CornersPlus2);
    let is_fixed = uncut.vertex_sharpness[vertex] >= INFINITELY_SHARP;
    let all = match values {
        _ if rule == F::Boundaries => true,
        _ if is_seam && is_fixed => true,
        [_] if is_seam => rule == F::CornersPlus2,
        [_, _] if depends_on_others => {
            values.iter().any(|&v| spans.is_disjoint(v))
                || rule == F::CornersPlus2 && values.iter().any(is_one_face)
        }
        [_, _, _, ..] => depends_on_others,
        _ => false,
    };
    let keeps_corners = rule != F::None;
    for value in values {
        if all || spans.n_fans[*value as usize] > 1 || keeps_corners && is_one_face(value) {
            cut.vertex_sharpness[*value as usize] = INFINITELY_SHARP;
        }
    }
}
