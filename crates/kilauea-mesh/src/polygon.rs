use std::borrow::Cow;

use kilauea_math::DAffine3;

use crate::channel::{Channel, Counts, Domain};
use crate::motion::later_poses_of;
use crate::payload::{PolyMesh, Primvar};
use crate::report::Report;
use crate::surface::{FaceSizes, Parts, Surface, SurfaceKey};

/// The faces of a mesh, all in range.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Topology<'a> {
    pub(crate) sizes: FaceSizes<'a>,
    pub(crate) corner_points: &'a [u32],
    pub(crate) counts: Counts,
}

/// Checks that faces and points fit together; the mesh cannot be used otherwise.
pub(crate) fn check_topology<'a>(mesh: &PolyMesh<'a>, report: &mut Report) -> Option<Topology<'a>> {
    let counts = mesh.face_vertex_counts;
    let indices = mesh.face_vertex_indices;
    if let Some(at) = counts.iter().position(|&c| c < 0) {
        let what = format_args!("[{at}] is {}; mesh skipped", counts[at]);
        report.warn(mesh.path, "faceVertexCounts", what);
        return None;
    }
    let n_corners: u64 = counts.iter().map(|&c| c as u64).sum();
    if n_corners != indices.len() as u64 || n_corners >= u64::from(u32::MAX / 2) {
        let what = format_args!(
            "add up to {n_corners}, but there are {} faceVertexIndices; mesh skipped",
            indices.len()
        );
        report.warn(mesh.path, "faceVertexCounts", what);
        return None;
    }
    let n_points = mesh.points.len();
    let corner_points: &[u32] = bytemuck::cast_slice(indices);
    // Negative indices are huge as u32.
    if let Some(at) = corner_points.iter().position(|&p| p as usize >= n_points) {
        let what = format_args!(
            "[{at}] is {}, outside 0..{n_points}; mesh skipped",
            indices[at]
        );
        report.warn(mesh.path, "faceVertexIndices", what);
        return None;
    }
    let n_degenerate = counts.iter().filter(|&&c| c < 3).count();
    if n_degenerate > 0 {
        let what = format_args!("{n_degenerate} faces with fewer than 3 corners skipped");
        report.warn(mesh.path, "faceVertexCounts", what);
    }
    let sizes = match counts.first() {
        Some(&size) if size > 0 && counts.iter().all(|&c| c == size) => {
            FaceSizes::All(size as usize)
        }
        _ => FaceSizes::Each(counts),
    };
    Some(Topology {
        sizes,
        corner_points,
        counts: Counts {
            points: n_points,
            faces: counts.len(),
            corners: indices.len(),
        },
    })
}

/// The part of faces that no subset has claimed yet.
const UNASSIGNED: u32 = Parts::HOLE - 1;

/// Sorts faces by material and leaves out holes.
pub(crate) fn assign_parts(mesh: &PolyMesh<'_>, n_faces: usize, report: &mut Report) -> Parts {
    if mesh.subsets.is_empty() && mesh.hole_indices.is_empty() {
        return Parts {
            materials: vec![mesh.material],
            of_face: None,
        };
    }
    let mut materials: Vec<u32> = Vec::new();
    let mut part_of = |material| {
        let found = materials.iter().position(|&m| m == material);
        found.unwrap_or_else(|| {
            materials.push(material);
            materials.len() - 1
        }) as u32
    };
    let mut of_face = vec![UNASSIGNED; n_faces];
    let mut n_outside = 0;
    let mut n_twice = 0;
    for subset in &mesh.subsets {
        let part = part_of(subset.material);
        for &face in subset.faces {
            match of_face.get_mut(face as u32 as usize) {
                None => n_outside += 1,
                Some(slot) if *slot == UNASSIGNED => *slot = part,
                Some(_) => n_twice += 1,
            }
        }
    }
    if n_outside > 0 {
        let what = format_args!("{n_outside} face indices outside 0..{n_faces} ignored");
        report.warn(mesh.path, "subset indices", what);
    }
    if n_twice > 0 {
        let what = format_args!("{n_twice} faces are in several subsets; the first counts");
        report.warn(mesh.path, "subset indices", what);
    }
    let own = part_of(mesh.material);
    for slot in of_face.iter_mut().filter(|slot| **slot == UNASSIGNED) {
        *slot = own;
    }
    let mut n_outside = 0;
    for &face in mesh.hole_indices {
        match of_face.get_mut(face as u32 as usize) {
            None => n_outside += 1,
            Some(slot) => *slot = Parts::HOLE,
        }
    }
    if n_outside > 0 {
        let what = format_args!("{n_outside} face indices outside 0..{n_faces} ignored");
        report.warn(mesh.path, "holeIndices", what);
    }
    Parts {
        materials,
        of_face: Some(of_face),
    }
}

/// The primvars that fit the mesh.
pub(crate) fn check_primvars<'a>(
    path: &str,
    primvars: &[Primvar<'a>],
    counts: Counts,
    report: &mut Report,
) -> Vec<Channel<'a>> {
    let mut channels: Vec<Channel<'a>> = Vec::with_capacity(primvars.len());
    for primvar in primvars {
        match Channel::from_primvar(primvar, counts) {
            Ok(_) if channels.iter().any(|c| c.name == primvar.name) => {
                let what = "given twice; the first counts";
                report.warn(path, &format!("primvars:{}", primvar.name), what);
            }
            Ok(channel) => channels.push(channel),
            Err(what) => {
                let what = format_args!("{what}; primvar ignored");
                report.warn(path, &format!("primvars:{}", primvar.name), what);
            }
        }
    }
    channels
}

/// A polygon mesh as it is.
pub(crate) fn polygon_surface<'a>(
    mesh: &PolyMesh<'a>,
    topology: &Topology<'a>,
    prototype_from_mesh: DAffine3,
    has_bad_points: bool,
    report: &mut Report,
) -> Surface<'a> {
    let counts = topology.counts;
    // The normals of a cage mean nothing to its limit surface.
    let authored = mesh.normals.as_ref().filter(|_| mesh.subdivision.is_none());
    let normals =
        authored.and_then(|primvar| normals_channel(mesh.path, primvar, topology, report));
    let later_keys = later_poses_of(mesh, prototype_from_mesh, report)
        .iter()
        .map(|pose| {
            let own = pose.normals.as_ref().filter(|_| normals.is_some());
            let own = own.and_then(|primvar| normals_channel(mesh.path, primvar, topology, report));
            let fits = |own: &Channel<'_>| normals.as_ref().is_some_and(|n| n.domain == own.domain);
            SurfaceKey {
                points: Cow::Borrowed(pose.points),
                normals: own.filter(fits).or_else(|| normals.clone()),
                prototype_from_points: prototype_from_mesh,
            }
        });
    let later_keys = later_keys.collect();
    Surface {
        points: Cow::Borrowed(mesh.points),
        corner_points: Cow::Borrowed(topology.corner_points),
        sizes: topology.sizes,
        source_faces: None,
        parts: assign_parts(mesh, counts.faces, report),
        normals,
        channels: check_primvars(mesh.path, &mesh.primvars, counts, report),
        prototype_from_points: prototype_from_mesh,
        left_handed: mesh.left_handed,
        has_bad_points,
        n_dropped: 0,
        later_keys,
    }
}

/// Normals that fit the mesh, by point or by corner.
fn normals_channel<'a>(
    path: &str,
    primvar: &Primvar<'a>,
    topology: &Topology<'a>,
    report: &mut Report,
) -> Option<Channel<'a>> {
    let what = match Channel::from_primvar(primvar, topology.counts) {
        Ok(channel) if channel.width == 3 => return Some(by_corner_if_by_face(channel, topology)),
        Ok(channel) => format!("has {} floats a value, expected 3", channel.width),
        Err(what) => what,
    };
    report.warn(path, "normals", format_args!("{what}; faceted"));
    None
}

/// Vertices have normals and triangles do not, so uniform normals go to the corners.
fn by_corner_if_by_face<'a>(channel: Channel<'a>, topology: &Topology<'_>) -> Channel<'a> {
    if channel.domain != Domain::Face {
        return channel;
    }
    let n_faces = topology.counts.faces;
    let indices = (0..n_faces).flat_map(|face| {
        let index = channel.indices.as_ref().map_or(face as u32, |i| i[face]);
        std::iter::repeat_n(index, topology.sizes.size(face))
    });
    Channel {
        domain: Domain::Corner,
        indices: Some(Cow::Owned(indices.collect())),
        ..channel
    }
}
