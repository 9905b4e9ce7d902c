use crate::payload::{PolyMesh, Subdivision};
use crate::report::Report;
use crate::surface::Surface;
use crate::tokens::BoundaryInterpolation;

use super::topology::{INFINITELY_SHARP, Layout, NONE, Topology};

/// The control mesh of a subdivision surface.
pub(crate) struct Cage {
    pub(crate) topology: Topology,
    /// Mesh face of each face.
    pub(crate) source_faces: Vec<u32>,
    /// Mesh corner of each corner.
    pub(crate) source_corners: Vec<u32>,
    /// Faces that only support others.
    pub(crate) undrawn: Vec<u32>,
    /// The highest sharpness that fades out, or zero.
    pub(crate) semi_sharpness: f32,
    pub(crate) has_creases: bool,
}

/// Joins the faces that `keep`s says are usable.
pub(crate) fn build_cage(
    mesh: &PolyMesh<'_>,
    subdivision: &Subdivision<'_>,
    surface: &Surface<'_>,
    keep: impl Fn(&[u32]) -> bool,
    report: &mut Report,
) -> Cage {
    let mut first = vec![0];
    let mut face_of = Vec::new();
    let mut vertex = Vec::new();
    let mut source_faces = Vec::new();
    let mut source_corners = Vec::new();
    let n_corners = surface.corner_points.len();
    let mut at = 0;
    for face in 0..surface.sizes.n_faces(n_corners) {
        let corners = at..at + surface.sizes.size(face);
        at = corners.end;
        let points = &surface.corner_points[corners.clone()];
        if points.len() < 3 || !keep(points) {
            continue;
        }
        face_of.extend(std::iter::repeat_n(source_faces.len() as u32, points.len()));
        source_faces.push(face as u32);
        source_corners.extend(corners.map(|c| c as u32));
        vertex.extend_from_slice(points);
        first.push(vertex.len() as u32);
    }
    let is_triangles = first.windows(2).all(|w| w[1] - w[0] == 3);
    let layout = if is_triangles {
        Layout::Triangles
    } else {
        Layout::Polygons {
            first,
            face: face_of,
        }
    };
    let (mut topology, edge_keys) = join(surface.points.len(), layout, vertex);
    let edge_between = |a: i32, b: i32| {
        let key = edge_key(a as u32, b as u32);
        edge_keys.binary_search(&key).ok()
    };
    let sharpness = set_creases(mesh, subdivision, &mut topology, edge_between, report)
        .max(set_corners(mesh, subdivision, &mut topology, report));
    let has_creases = topology.edge_sharpness.iter().any(|&s| s > 0.0)
        || topology.vertex_sharpness.iter().any(|&s| s > 0.0);
    let undrawn = set_boundaries(subdivision.interpolate_boundary, &mut topology);
    Cage {
        topology,
        source_faces,
        source_corners,
        undrawn,
        semi_sharpness: sharpness,
        has_creases,
    }
}

fn edge_key(a: u32, b: u32) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

/// Finds twins and edges by sorting half-edges by their ends; also the sorted key of each edge.
///
/// Edges with more than two faces, with two faces of opposite winding, or with one end only have
/// no twins: the surface ends there.
fn join(n_vertices: usize, layout: Layout, vertex: Vec<u32>) -> (Topology, Vec<u64>) {
    let n_corners = vertex.len();
    let mut topology = Topology {
        n_vertices,
        layout,
        vertex,
        twin: vec![NONE; n_corners],
        edge: vec![0; n_corners],
        edge_half: Vec::new(),
        edge_sharpness: Vec::new(),
        vertex_sharpness: vec![0.0; n_vertices],
    };
    let mut halves: Vec<(u64, u32)> = (0..n_corners as u32)
        .map(|h| {
            let (a, b) = (h as usize, topology.next(h) as usize);
            (edge_key(topology.vertex[a], topology.vertex[b]), h)
        })
        .collect();
    halves.sort_unstable();
    let mut edge_keys = Vec::new();
    for group in halves.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, g), (_, h)] = *group {
            let [a, b] = [g, h].map(|h| topology.vertex[h as usize]);
            if a != b {
                topology.twin[g as usize] = h;
                topology.twin[h as usize] = g;
            }
        }
        for &(_, h) in group {
            topology.edge[h as usize] = edge_keys.len() as u32;
        }
        topology.edge_half.push(group[0].1);
        edge_keys.push(group[0].0);
    }
    topology.edge_sharpness = vec![0.0; edge_keys.len()];
    (topology, edge_keys)
}

/// Sharpens edges along creases; the highest sharpness that fades out.
fn set_creases(
    mesh: &PolyMesh<'_>,
    subdivision: &Subdivision<'_>,
    topology: &mut Topology,
    edge_between: impl Fn(i32, i32) -> Option<usize>,
    report: &mut Report,
) -> f32 {
    let lengths = subdivision.crease_lengths;
    let sharpnesses = subdivision.crease_sharpnesses;
    let n_indices: i64 = lengths.iter().map(|&n| i64::from(n)).sum();
    let n_edges: i64 = n_indices - lengths.len() as i64;
    let is_per_crease = sharpnesses.len() == lengths.len();
    let fits = lengths.iter().all(|&n| n >= 2)
        && n_indices == subdivision.crease_indices.len() as i64
        && (is_per_crease || sharpnesses.len() as i64 == n_edges);
    if !fits {
        let what = "lengths, indices and sharpnesses do not fit; creases ignored";
        report.warn(mesh.path, "creaseLengths", what);
        return 0.0;
    }
    let mut rest = subdivision.crease_indices;
    let mut edge_number = 0;
    let mut n_missing = 0;
    let mut highest = 0.0_f32;
    for (crease, &length) in lengths.iter().enumerate() {
        let (points, tail) = rest.split_at(length as usize);
        rest = tail;
        for ends in points.windows(2) {
            let sharpness = sharpnesses[if is_per_crease { crease } else { edge_number }];
            edge_number += 1;
            let Some(edge) = edge_between(ends[0], ends[1]) else {
                n_missing += 1;
                continue;
            };
            let slot = &mut topology.edge_sharpness[edge];
            *slot = slot.max(sharpness);
            highest = highest.max(semi_sharp(sharpness));
        }
    }
    if n_missing > 0 {
        let what = format_args!("{n_missing} creases between points without an edge ignored");
        report.warn(mesh.path, "creaseIndices", what);
    }
    highest
}

/// Sharpens vertices at corners; the highest sharpness that fades out.
fn set_corners(
    mesh: &PolyMesh<'_>,
    subdivision: &Subdivision<'_>,
    topology: &mut Topology,
    report: &mut Report,
) -> f32 {
    let indices = subdivision.corner_indices;
    let sharpnesses = subdivision.corner_sharpnesses;
    if indices.len() != sharpnesses.len() {
        let what = "indices and sharpnesses do not fit; corners ignored";
        report.warn(mesh.path, "cornerIndices", what);
        return 0.0;
    }
    let mut n_outside = 0;
    let mut highest = 0.0_f32;
    for (&index, &sharpness) in indices.iter().zip(sharpnesses) {
        match topology.vertex_sharpness.get_mut(index as u32 as usize) {
            None => n_outside += 1,
            Some(slot) => {
                *slot = slot.max(sharpness);
                highest = highest.max(semi_sharp(sharpness));
            }
        }
    }
    if n_outside > 0 {
        let what = format_args!("{n_outside} corners outside the points ignored");
        report.warn(mesh.path, "cornerIndices", what);
    }
    highest
}

fn semi_sharp(sharpness: f32) -> f32 {
    if sharpness < INFINITELY_SHARP {
        sharpness
    } else {
        0.0
    }
}

/// Sharpens where the surface ends, and vertices where it is not a disk; gives the faces that
/// are not drawn because their boundary is not interpolated.
fn set_boundaries(rule: BoundaryInterpolation, topology: &mut Topology) -> Vec<u32> {
    let mut n_fans = vec![0_u32; topology.n_vertices];
    let mut sharp = Vec::new();
    let mut undrawn = Vec::new();
    topology.for_each_fan(|fan, is_closed| {
        let v = topology.vertex[fan[0] as usize] as usize;
        n_fans[v] += 1;
        if is_closed {
            return;
        }
        let is_corner = fan.len() == 1;
        if is_corner && rule == BoundaryInterpolation::EdgeAndCorner {
            sharp.push(v);
        }
        let last = topology.prev(fan[fan.len() - 1]);
        let is_creased = [fan[0], last].iter().all(|&h| {
            topology.edge_sharpness[topology.edge[h as usize] as usize] >= INFINITELY_SHARP
        });
        if rule == BoundaryInterpolation::None && !is_creased {
            undrawn.extend(fan.iter().map(|&c| topology.face(c)));
        }
    });
    sharp.extend((0..topology.n_vertices).filter(|&v| n_fans[v] > 1));
    for v in sharp {
        topology.vertex_sharpness[v] = INFINITELY_SHARP;
    }
    for h in 0..topology.n_corners() {
        if topology.twin[h] == NONE {
            topology.edge_sharpness[topology.edge[h] as usize] = INFINITELY_SHARP;
        }
    }
    undrawn
}
