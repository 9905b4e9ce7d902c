//! Prototypes in the terms of the acceleration structure.

use kilauea_accel as accel;
use kilauea_scene::{CurveBasis, CurveProfile, Prototype, Visibility};

/// A prototype's surfaces, borrowing their arrays. Of chunks that are not here, by their number, there
/// is nothing but the place.
pub(super) fn accel_geometry(
    prototype: &Prototype,
    is_here: impl Fn(u32) -> bool,
) -> accel::Geometry<'_> {
    let n_meshes = prototype.chunks.len() as u32;
    let n_before_curves = n_meshes + prototype.points.len() as u32;
    let meshes = (0..).zip(&prototype.chunks).map(|(number, chunk)| {
        if !is_here(number) {
            return accel::Mesh::still(&[], &[]);
        }
        let later = chunk.later_keys.iter().map(|key| &key.positions);
        accel::Mesh {
            positions: keys(&chunk.positions, later),
            triangles: &chunk.triangles,
            visibility: accel_visibility(chunk.visibility),
        }
    });
    let spheres = (n_meshes..).zip(&prototype.points).map(|(number, chunk)| {
        let is_here = is_here(number);
        accel::Spheres {
            centers: keys(&chunk.centers, chunk.later_centers.iter()),
            radii: if is_here { &chunk.radii } else { &[] },
            visibility: accel_visibility(chunk.visibility),
        }
    });
    let curves = (n_before_curves..).zip(&prototype.curves);
    let curves = curves.map(|(number, chunk)| accel::Curves {
        points: keys(&chunk.points, chunk.later_points.iter()),
        radii: &chunk.radii,
        normals: chunk.normals.as_deref(),
        segments: if is_here(number) {
            &chunk.segments
        } else {
            &[]
        },
        basis: match chunk.basis {
            CurveBasis::Linear => accel::CurveBasis::Linear,
            CurveBasis::Bezier => accel::CurveBasis::Bezier,
        },
        profile: match chunk.profile {
            CurveProfile::Round => accel::CurveProfile::Round,
            CurveProfile::Ribbon => accel::CurveProfile::Ribbon,
        },
        visibility: accel_visibility(chunk.visibility),
    });
    accel::Geometry {
        meshes: meshes.collect(),
        spheres: spheres.collect(),
        curves: curves.collect(),
    }
}

/// The same kinds of rays.
pub(super) fn accel_visibility(visibility: Visibility) -> accel::Visibility {
    accel::Visibility(visibility.0)
}

fn keys<'a>(
    first: &'a Vec<[f32; 3]>,
    later: impl Iterator<Item = &'a Vec<[f32; 3]>>,
) -> Vec<&'a [[f32; 3]]> {
    std::iter::once(first)
        .chain(later)
        .map(Vec::as_slice)
        .collect()
}
