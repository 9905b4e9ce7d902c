//! Subdivision surfaces: uniform refinement, then points and normals of the limit surface.
//!
//! The rules are those that OpenSubdiv documents (Catmull-Clark, Loop and bilinear; semi-sharp
//! creases and corners that lose one unit of sharpness per level; boundary and face-varying
//! rules), so that surfaces agree with other renderers of USD.

mod cage;
mod level;
mod limit;
mod neighbours;
mod normals;
mod refined;
mod rings;
mod rules;
mod seams;
mod smooth;
mod split;
mod topology;

use std::borrow::Cow;

use kilauea_math::{DAffine3, DVec3};

use crate::channel::{Channel, Domain};
use crate::payload::{PolyMesh, Subdivision};
use crate::report::Report;
use crate::surface::{FaceSizes, Parts, Surface, SurfaceKey, is_placeable};
use crate::tokens::{FaceVaryingRule, PrimvarInterpolation, Scheme};

use cage::{Cage, build_cage};
use refined::{Refinement, Values};
use seams::cut_along_seams;
use topology::Layout;

/// How finely a mesh is seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SizeOnScreen {
    /// Where the mesh looks largest, per unit of its own space; infinite if the camera is inside.
    pub(crate) pixels_per_unit: f64,
    /// Short enough.
    pub(crate) pixels_per_edge: f64,
    pub(crate) max_level: u32,
}

/// The limit surface of a cage, as finely as it is seen.
///
/// Level 0 has the cage's faces, with points and normals on the limit surface; bilinear surfaces
/// are faceted. Loop surfaces of anything but triangles are drawn as the cage.
pub(crate) fn subdivide<'a>(
    mesh: &PolyMesh<'a>,
    subdivision: &Subdivision<'a>,
    control: Surface<'a>,
    size: SizeOnScreen,
    report: &mut Report,
) -> Surface<'a> {
    let prototype_from_mesh = control.prototype_from_points;
    let is_good = |p: &[f32; 3]| {
        let p = DVec3::from_array(p.map(f64::from));
        is_placeable(p) && is_placeable(prototype_from_mesh.transform_point3(p))
    };
    let keep = |face: &[u32]| {
        !control.has_bad_points || face.iter().all(|&v| is_good(&control.points[v as usize]))
    };
    let cage = build_cage(mesh, subdivision, &control, keep, report);
    if subdivision.scheme == Scheme::Loop && !matches!(cage.topology.layout, Layout::Triangles) {
        let what = "loop needs triangles; drawn without subdivision";
        report.warn(mesh.path, "subdivisionScheme", what);
        return control;
    }
    let level = level::choose_level(&cage, subdivision.scheme, &control.points, size);
    if level == 0 && subdivision.scheme == Scheme::Bilinear || cage.source_faces.is_empty() {
        return control;
    }
    let mut control = control;
    let later_keys: Vec<SurfaceKey<'a>> = std::mem::take(&mut control.later_keys)
        .into_iter()
        .map(|key| {
            let posed = at_key(&control, key);
            let limit = limit_surface(mesh, subdivision, posed, &cage, level, is_good);
            SurfaceKey {
                points: limit.points,
                normals: limit.normals,
                prototype_from_points: limit.prototype_from_points,
            }
        })
        .collect();
    Surface {
        later_keys,
        ..limit_surface(mesh, subdivision, control, &cage, level, is_good)
    }
}

/// The cage at a later motion key, without what does not move.
fn at_key<'a>(control: &Surface<'a>, key: SurfaceKey<'a>) -> Surface<'a> {
    Surface {
        points: key.points,
        corner_points: control.corner_points.clone(),
        sizes: control.sizes,
        source_faces: None,
        parts: Parts::default(),
        normals: None,
        channels: Vec::new(),
        prototype_from_points: key.prototype_from_points,
        left_handed: control.left_handed,
        has_bad_points: control.has_bad_points,
        n_dropped: 0,
        later_keys: Vec::new(),
    }
}

fn limit_surface<'a>(
    mesh: &PolyMesh<'a>,
    subdivision: &Subdivision<'a>,
    control: Surface<'a>,
    cage: &Cage,
    level: u32,
    is_good: impl Fn(&[f32; 3]) -> bool,
) -> Surface<'a> {
    let refinement = Refinement {
        scheme: subdivision.scheme,
        triangle_rule: subdivision.triangle_rule,
        level,
    };
    // Smoothing near the origin keeps the digits that differences need.
    let origin = middle(control.points.iter().filter(|p| is_good(p)));
    let mut shared = vec![Values {
        width: 3,
        is_linear: false,
        data: control
            .points
            .iter()
            .flat_map(|p| [p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]])
            .collect(),
    }];
    let by_point = |c: &&Channel<'_>| c.domain == Domain::Point;
    for channel in control.channels.iter().filter(by_point) {
        let of_points = 0..control.points.len() as u32;
        shared.push(Values {
            width: channel.width,
            is_linear: is_varying(mesh, channel.name),
            data: of_points.flat_map(|p| channel.value(p)).copied().collect(),
        });
    }
    let refined = refinement.run(cage.topology.clone(), shared, true);
    let mut shared = refined.values.into_iter();
    let points = shared.next().map_or_else(Vec::new, |v| v.data);

    let corners = Corners { cage, level };
    let mut channels = Vec::with_capacity(control.channels.len());
    for channel in &control.channels {
        let (values, indices) = match channel.domain {
            Domain::Constant | Domain::Face => {
                channels.push(channel.clone());
                continue;
            }
            Domain::Point => (shared.next().map_or_else(Vec::new, |v| v.data), None),
            Domain::Corner => {
                let (values, of_corner) =
                    refine_face_varying(subdivision, cage, channel, refinement);
                let of_corner = corners.in_surface(of_corner, control.corner_points.len());
                (values, Some(Cow::Owned(of_corner)))
            }
        };
        channels.push(Channel {
            values: Cow::Owned(values),
            indices,
            ..channel.clone()
        });
    }
    let normals = refined.normals.map(|(mut normals, of_corner)| {
        if control.left_handed {
            normals.iter_mut().flatten().for_each(|x| *x = -*x);
        }
        // Level 0 was refined once; the corners of the cage come first in their quads.
        let of_corner = if level == 0 {
            let first = |c| of_corner[refinement.first_child(c)];
            (0..cage.topology.n_corners()).map(first).collect()
        } else {
            of_corner
        };
        let of_corner = corners.in_surface(of_corner, control.corner_points.len());
        Channel {
            name: "normals",
            width: 3,
            domain: Domain::Corner,
            values: Cow::Owned(normals.into_flattened()),
            indices: Some(Cow::Owned(of_corner)),
        }
    });
    let shift = DVec3::from_array(origin.map(f64::from));
    let mut surface = Surface {
        points: Cow::Owned(points.as_chunks::<3>().0.to_vec()),
        parts: without(control.parts, cage, mesh.face_vertex_counts.len()),
        normals,
        channels,
        prototype_from_points: control.prototype_from_points * DAffine3::from_translation(shift),
        ..control
    };
    if level > 0 {
        let size = if subdivision.scheme == Scheme::Loop {
            3
        } else {
            4
        };
        let n_faces = refined.topology.n_faces();
        surface.source_faces = Some((0..n_faces).map(|f| corners.source_face(f, size)).collect());
        surface.corner_points = Cow::Owned(refined.topology.vertex);
        surface.sizes = FaceSizes::All(size);
        surface.has_bad_points = false;
        surface.n_dropped = n_dropped(mesh, cage);
    }
    surface
}

/// Refined values of a face-varying channel, and which one each corner has.
fn refine_face_varying(
    subdivision: &Subdivision<'_>,
    cage: &Cage,
    channel: &Channel<'_>,
    refinement: Refinement,
) -> (Vec<f32>, Vec<u32>) {
    let rule = subdivision.face_varying_linear_interpolation;
    let cut = cut_along_seams(cage, channel, rule);
    let values = Values {
        width: channel.width,
        is_linear: rule == FaceVaryingRule::All,
        data: cut
            .corners
            .iter()
            .flat_map(|&corner| channel.value(corner))
            .copied()
            .collect(),
    };
    let of_cage_corner = (refinement.level == 0).then(|| cut.topology.vertex.clone());
    let refined = refinement.run(cut.topology, vec![values], false);
    let values = refined.values.into_iter().next();
    (
        values.map_or_else(Vec::new, |v| v.data),
        of_cage_corner.unwrap_or(refined.topology.vertex),
    )
}

/// How corners and faces of the refined cage relate to the surface that is drawn.
struct Corners<'c> {
    cage: &'c Cage,
    level: u32,
}

impl Corners<'_> {
    /// Level 0 is drawn with the corners of the mesh, of which the cage has those it could use.
    fn in_surface(&self, of_corner: Vec<u32>, n_mesh_corners: usize) -> Vec<u32> {
        if self.level > 0 {
            return of_corner;
        }
        let mut of_mesh_corner = vec![0; n_mesh_corners];
        for (&corner, index) in self.cage.source_corners.iter().zip(of_corner) {
            of_mesh_corner[corner as usize] = index;
        }
        of_mesh_corner
    }

    /// The mesh face of a face that was refined.
    fn source_face(&self, face: usize, size: usize) -> u32 {
        let topology = &self.cage.topology;
        let cage_face = if size == 3 {
            face >> (2 * self.level)
        } else {
            topology.face((face >> (2 * (self.level - 1))) as u32) as usize
        };
        self.cage.source_faces[cage_face]
    }
}

fn is_varying(mesh: &PolyMesh<'_>, name: &str) -> bool {
    let primvar = mesh.primvars.iter().find(|p| p.name == name);
    primvar.is_some_and(|p| p.interpolation == PrimvarInterpolation::Varying)
}

/// The middle of the points' box.
fn middle<'p>(points: impl Iterator<Item = &'p [f32; 3]>) -> [f32; 3] {
    let mut range = [[f32::INFINITY, f32::NEG_INFINITY]; 3];
    for p in points {
        for (range, x) in range.iter_mut().zip(p) {
            *range = [range[0].min(*x), range[1].max(*x)];
        }
    }
    range.map(|[min, max]| {
        if min <= max {
            0.5 * min + 0.5 * max
        } else {
            0.0
        }
    })
}

/// The parts without the faces that only support others.
fn without(mut parts: Parts, cage: &Cage, n_faces: usize) -> Parts {
    if !cage.undrawn.is_empty() {
        let of_face = parts.of_face.get_or_insert_with(|| vec![0; n_faces]);
        for &face in &cage.undrawn {
            of_face[cage.source_faces[face as usize] as usize] = Parts::HOLE;
        }
    }
    parts
}

/// Triangles of the faces that the cage could not use.
fn n_dropped(mesh: &PolyMesh<'_>, cage: &Cage) -> usize {
    let n_triangles = |n_corners: usize, n_faces: usize| n_corners - 2 * n_faces;
    let all: usize = mesh
        .face_vertex_counts
        .iter()
        .map(|&n| (n as usize).saturating_sub(2))
        .sum();
    all - n_triangles(cage.source_corners.len(), cage.source_faces.len())
}
