//! Motion keys that fit their first.

use kilauea_math::{DAffine3, DVec3};

use crate::payload::{MeshPose, PolyMesh};
use crate::report::Report;
use crate::surface::is_placeable;

/// The later keys of points that move; none, with a warning, where their number changes.
pub(crate) fn later_keys_of<'p, 'a>(
    path: &str,
    points: &[[f32; 3]],
    later_points: &'p [&'a [[f32; 3]]],
    report: &mut Report,
) -> &'p [&'a [[f32; 3]]] {
    if later_points.iter().all(|key| key.len() == points.len()) {
        return later_points;
    }
    report.warn(path, "points", CHANGING);
    &[]
}

/// The later keys of a mesh; none, with a warning, where they do not fit the first.
pub(crate) fn later_poses_of<'p, 'a>(
    mesh: &'p PolyMesh<'a>,
    prototype_from_mesh: DAffine3,
    report: &mut Report,
) -> &'p [MeshPose<'a>] {
    let poses = &mesh.later_keys;
    let is_finite = |p: [f32; 3]| {
        let p = DVec3::from_array(p.map(f64::from));
        is_placeable(p) && is_placeable(prototype_from_mesh.transform_point3(p))
    };
    if poses
        .iter()
        .any(|pose| pose.points.len() != mesh.points.len())
    {
        report.warn(mesh.path, "points", CHANGING);
        &[]
    } else if !poses
        .iter()
        .flat_map(|pose| pose.points)
        .all(|&p| is_finite(p))
    {
        let what = "not finite at a later motion key; no motion";
        report.warn(mesh.path, "points", what);
        &[]
    } else {
        poses
    }
}

const CHANGING: &str = "their number changes while the shutter is open; no motion";
