use kilauea_math::{DAffine3, DVec3, Mat3, Vec3};
use kilauea_scene::{Attribute, Interpolation, MeshChunk, MeshKey, Visibility};

use rayon::prelude::*;

use crate::channel::{Channel, Domain};
use crate::pieces::split_into_pieces;
use crate::report::Report;
use crate::surface::{Surface, Triangle, triangles_of_parts};
use crate::weld::Welder;

/// What all chunks of a mesh have in common.
pub(crate) struct ChunkSettings<'a> {
    pub(crate) prim_idx: u32,
    pub(crate) double_sided: bool,
    /// Point of prototype space that positions are relative to.
    pub(crate) center: DVec3,
    /// Constant primvars that replace those of the same name.
    pub(crate) overrides: &'a [Attribute],
    /// Triangles, segments or points in a chunk.
    pub(crate) max_primitives: usize,
    pub(crate) visibility: Visibility,
}

/// Splits a surface by material and space and gives each piece its own compact arrays. Also returns
/// how many triangles were dropped because of their points.
pub(crate) fn build_chunks(
    path: &str,
    surface: &Surface<'_>,
    settings: &ChunkSettings<'_>,
    report: &mut Report,
) -> (Vec<MeshChunk>, usize) {
    let (parts, n_dropped) = triangles_of_parts(surface);
    let mut pieces = Vec::new();
    for (triangles, &material) in parts.into_iter().zip(&surface.parts.materials) {
        let centroid = |t: &Triangle| {
            t.corners.iter().fold(Vec3::ZERO, |sum, &c| {
                sum + Vec3::from_array(surface.points[surface.corner_points[c as usize] as usize])
            })
        };
        let split = split_into_pieces(triangles, settings.max_primitives, centroid);
        let built = split.into_par_iter().map_init(
            || Welder::new(surface.points.len()),
            |welder, piece| build_chunk(surface, settings, welder, &piece, material),
        );
        pieces.par_extend(built);
    }
    let attributes = pieces
        .iter_mut()
        .flat_map(|c: &mut MeshChunk| &mut c.attributes);
    zero_what_is_not_finite(path, attributes, report);
    (pieces, n_dropped)
}

/// Puts zeros where primvars are no numbers, with one warning for each name.
pub(crate) fn zero_what_is_not_finite<'c>(
    path: &str,
    attributes: impl Iterator<Item = &'c mut Attribute>,
    report: &mut Report,
) {
    let mut names: Vec<&str> = Vec::new();
    for attribute in attributes {
        let mut bad = false;
        for x in attribute.data.iter_mut().filter(|x| !x.is_finite()) {
            *x = 0.0;
            bad = true;
        }
        if bad && !names.contains(&&attribute.name[..]) {
            names.push(&attribute.name);
        }
    }
    for name in names {
        let what = "has values that are not finite; zero instead";
        report.warn(path, &format!("primvars:{name}"), what);
    }
}

fn build_chunk(
    surface: &Surface<'_>,
    settings: &ChunkSettings<'_>,
    welder: &mut Welder,
    piece: &[Triangle],
    material: u32,
) -> MeshChunk {
    welder.clear();
    let splitting: Vec<&Channel<'_>> = surface
        .channels
        .iter()
        .chain(&surface.normals)
        .chain(
            surface
                .later_keys
                .iter()
                .filter_map(|key| key.normals.as_ref()),
        )
        .filter(|c| c.domain == Domain::Corner)
        .collect();
    let triangles: Vec<[u32; 3]> = piece
        .iter()
        .map(|t| {
            t.corners.map(|corner| {
                let point = surface.corner_points[corner as usize];
                welder.vertex(point, corner, |a, b| splitting.iter().all(|c| c.same(a, b)))
            })
        })
        .collect();

    let first_key = vertices_at(
        &surface.points,
        surface.normals.as_ref(),
        &surface.prototype_from_points,
        settings.center,
        welder,
        &triangles,
    );
    let later_keys = surface.later_keys.iter().map(|key| {
        vertices_at(
            &key.points,
            key.normals.as_ref(),
            &key.prototype_from_points,
            settings.center,
            welder,
            &triangles,
        )
    });
    let later_keys = later_keys.collect();
    let is_overridden = |name: &str| settings.overrides.iter().any(|o| o.name == name);
    let attributes = surface
        .channels
        .iter()
        .filter(|c| !is_overridden(c.name))
        .map(|c| gather(c, welder, piece))
        .chain(settings.overrides.iter().cloned())
        .collect();
    MeshChunk {
        prim_idx: settings.prim_idx,
        material,
        positions: first_key.positions,
        triangles,
        normals: first_key.normals,
        attributes,
        double_sided: settings.double_sided,
        later_keys,
        visibility: settings.visibility,
    }
}

/// Positions and normals of a chunk's vertices at one motion key.
fn vertices_at(
    points: &[[f32; 3]],
    normals: Option<&Channel<'_>>,
    prototype_from_points: &DAffine3,
    center: DVec3,
    welder: &Welder,
    triangles: &[[u32; 3]],
) -> MeshKey {
    let position = |&p: &u32| {
        let p = Vec3::from_array(points[p as usize]).as_dvec3();
        let p_prototype = prototype_from_points.transform_point3(p);
        (p_prototype - center).as_vec3().to_array()
    };
    let positions: Vec<[f32; 3]> = welder.points().iter().map(position).collect();
    let normals = normals.map(|channel| {
        let normal_from_points = prototype_from_points.matrix3.inverse().transpose();
        let mut normals = shading_normals(channel, welder, normal_from_points.as_mat3());
        replace_invalid(&mut normals, &positions, triangles);
        normals
    });
    MeshKey { positions, normals }
}

/// A channel's values in the order of a chunk's vertices or triangles.
fn gather(channel: &Channel<'_>, welder: &Welder, piece: &[Triangle]) -> Attribute {
    let collect = |elements: &mut dyn Iterator<Item = u32>, n: usize| {
        let mut data = Vec::with_capacity(n * channel.width);
        elements.for_each(|e| data.extend_from_slice(channel.value(e)));
        data
    };
    let n_vertices = welder.points().len();
    let (interpolation, data) = match channel.domain {
        Domain::Constant => (Interpolation::Constant, channel.value(0).to_vec()),
        Domain::Face => (
            Interpolation::Uniform,
            collect(&mut piece.iter().map(|t| t.face), piece.len()),
        ),
        Domain::Point => (
            Interpolation::Vertex,
            collect(&mut welder.points().iter().copied(), n_vertices),
        ),
        Domain::Corner => (
            Interpolation::Vertex,
            collect(&mut welder.corners().iter().copied(), n_vertices),
        ),
    };
    Attribute {
        name: channel.name.to_owned(),
        width: channel.width as u8,
        interpolation,
        data,
    }
}

/// Normals by vertex in prototype space; zero where they have no direction.
fn shading_normals(
    channel: &Channel<'_>,
    welder: &Welder,
    normal_from_points: Mat3,
) -> Vec<[f32; 3]> {
    let normal = |element: u32| {
        let n = Vec3::from_slice(channel.value(element)).normalize_or_zero();
        (normal_from_points * n).normalize_or_zero().to_array()
    };
    match channel.domain {
        Domain::Constant | Domain::Face => vec![normal(0); welder.points().len()],
        Domain::Point => welder.points().iter().map(|&p| normal(p)).collect(),
        Domain::Corner => welder.corners().iter().map(|&c| normal(c)).collect(),
    }
}

/// Puts the area-weighted mean of the triangles' normals where a vertex has none.
fn replace_invalid(normals: &mut [[f32; 3]], positions: &[[f32; 3]], triangles: &[[u32; 3]]) {
    let invalid: Vec<bool> = normals.iter().map(|n| *n == [0.0; 3]).collect();
    if !invalid.contains(&true) {
        return;
    }
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| Vec3::from_array(positions[v as usize]));
        let area_normal = (b - a).cross(c - a);
        for &v in triangle.iter().filter(|&&v| invalid[v as usize]) {
            let sum = Vec3::from_array(normals[v as usize]) + area_normal;
            normals[v as usize] = sum.to_array();
        }
    }
    for (normal, _) in normals.iter_mut().zip(invalid).filter(|(_, bad)| *bad) {
        // Scaled up first: the squares of tiny areas underflow.
        let n = Vec3::from_array(*normal);
        let n = n / n.abs().max_element().max(f32::MIN_POSITIVE);
        *normal = n.normalize_or(Vec3::Z).to_array();
    }
}
