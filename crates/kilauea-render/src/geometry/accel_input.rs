//! Prototypes in the terms of the acceleration structure.

use kilauea_accel as accel;
use kilauea_scene::{CurveBasis, CurveProfile, Prototype, Visibility};

/// A prototype's surfaces, borrowing their arrays.
pub(super) fn accel_geometry(prototype: &Prototype) -> accel::Geometry<'_> {
    let meshes = prototype.chunks.iter().map(|chunk| {
        let later = chunk.later_keys.iter().map(|key| &key.positions);
        accel::Mesh {
            positions: keys(&chunk.positions, later),
            triangles: &chunk.triangles,
            visibility: accel_visibility(chunk.visibility),
        }
    });
    let spheres = prototype.points.iter().map(|chunk| accel::Spheres {
        centers: keys(&chunk.centers, chunk.later_centers.iter()),
        radii: &chunk.radii,
        visibility: accel_visibility(chunk.visibility),
    });
    let curves = prototype.curves.iter().map(|chunk| accel::Curves {
        points: keys(&chunk.points, chunk.later_points.iter()),
        radii: &chunk.radii,
        normals: chunk.normals.as_deref(),
        segments: &chunk.segments,
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
