//! Spheres, cubes, cylinders, cones, capsules and planes as triangles.

mod profile;
mod revolve;

use std::borrow::Cow;

use kilauea_math::{DAffine3, DVec3};

use crate::bounds::DBounds;
use crate::channel::{Channel, Counts, Domain};
use crate::payload::ImplicitShape;
use crate::polygon::check_primvars;
use crate::report::Report;
use crate::surface::{FaceSizes, Parts, Surface};
use crate::tokens::{Axis, ImplicitKind};

/// Points, faces of equal size, and normals where the shape is round.
pub(crate) struct Tessellation {
    pub(crate) points: Vec<[f32; 3]>,
    pub(crate) face_size: usize,
    pub(crate) corner_points: Vec<u32>,
    pub(crate) normals: Option<Vec<f32>>,
}

/// Whether the dimensions make sense; otherwise the shape is skipped.
pub(crate) fn check_dimensions(shape: &ImplicitShape<'_>, report: &mut Report) -> bool {
    let [a, b, c] = shape.dimensions;
    let is_finite = shape.dimensions.iter().all(|d| d.abs() < 1e30);
    let is_positive = match shape.kind {
        ImplicitKind::Sphere | ImplicitKind::Cube => a > 0.0,
        ImplicitKind::Cylinder | ImplicitKind::Capsule => {
            a >= 0.0 && b >= 0.0 && a + b > 0.0 && c >= 0.0
        }
        ImplicitKind::Cone => a > 0.0 && c >= 0.0,
        ImplicitKind::Plane => a > 0.0 && b > 0.0,
    };
    if !(is_finite && is_positive) {
        let what = format_args!("{:?} have no extent; shape skipped", shape.dimensions);
        report.warn(shape.path, "dimensions", what);
    }
    is_finite && is_positive
}

/// The box of a shape in its own space.
pub(crate) fn shape_bounds(shape: &ImplicitShape<'_>) -> DBounds {
    let [a, b, c] = shape.dimensions;
    // Across the spine (two axes), then down and up along it.
    let (across, low, high) = match shape.kind {
        ImplicitKind::Sphere => ([a, a], -a, a),
        ImplicitKind::Cube => ([0.5 * a; 2], -0.5 * a, 0.5 * a),
        ImplicitKind::Cylinder | ImplicitKind::Cone => ([a.max(b); 2], -0.5 * c, 0.5 * c),
        ImplicitKind::Capsule => ([a.max(b); 2], -0.5 * c - a, 0.5 * c + b),
        ImplicitKind::Plane => return plane_bounds(shape.axis, a, b),
    };
    let mut bounds = DBounds::EMPTY;
    bounds.include(on_axis(shape.axis, -across[0], -across[1], low));
    bounds.include(on_axis(shape.axis, across[0], across[1], high));
    bounds
}

/// A point from coordinates across and along the spine; keeps orientation.
fn on_axis(axis: Axis, across0: f64, across1: f64, along: f64) -> DVec3 {
    match axis {
        Axis::X => DVec3::new(along, across0, across1),
        Axis::Y => DVec3::new(across1, along, across0),
        Axis::Z => DVec3::new(across0, across1, along),
    }
}

/// UsdGeomPlane: width and length lie along z and y, x and z, or x and y.
fn plane_bounds(axis: Axis, width: f64, length: f64) -> DBounds {
    let half = match axis {
        Axis::X => DVec3::new(0.0, 0.5 * length, 0.5 * width),
        Axis::Y => DVec3::new(0.5 * width, 0.0, 0.5 * length),
        Axis::Z => DVec3::new(0.5 * width, 0.5 * length, 0.0),
    };
    DBounds {
        min: -half,
        max: half,
    }
}

/// Triangles for a shape; `pixels_per_unit` says how large a unit of its space looks and
/// `pixels_per_edge` how long edges may be.
pub(crate) fn tessellate(
    shape: &ImplicitShape<'_>,
    pixels_per_unit: f64,
    pixels_per_edge: f64,
) -> Tessellation {
    let [a, b, _] = shape.dimensions;
    match shape.kind {
        ImplicitKind::Cube => cube(0.5 * a),
        ImplicitKind::Plane => plane(shape),
        _ => {
            let n_around = revolve::segments_around(a.max(b) * pixels_per_unit, pixels_per_edge);
            let runs = profile::profile(shape.kind, shape.dimensions, n_around);
            revolve::revolve(&runs, n_around, |x, y, z| on_axis(shape.axis, x, y, z))
        }
    }
}

/// A shape as a surface; orientation is not read, the formula tells outside from inside.
pub(crate) fn implicit_surface<'a>(
    shape: &ImplicitShape<'a>,
    tessellation: Tessellation,
    prototype_from_mesh: DAffine3,
    report: &mut Report,
) -> Surface<'a> {
    let counts = Counts {
        points: tessellation.points.len(),
        faces: tessellation.corner_points.len() / tessellation.face_size,
        corners: tessellation.corner_points.len(),
    };
    let mut channels = check_primvars(shape.path, &shape.primvars, counts, report);
    channels.retain(|c| c.domain == Domain::Constant);
    Surface {
        points: Cow::Owned(tessellation.points),
        corner_points: Cow::Owned(tessellation.corner_points),
        sizes: FaceSizes::All(tessellation.face_size),
        source_faces: None,
        parts: Parts {
            materials: vec![shape.material],
            of_face: None,
        },
        normals: tessellation.normals.map(|values| Channel {
            name: "normals",
            width: 3,
            domain: Domain::Point,
            values: Cow::Owned(values),
            indices: None,
        }),
        channels,
        prototype_from_points: prototype_from_mesh,
        left_handed: false,
        has_bad_points: false,
        n_dropped: 0,
        later_keys: Vec::new(),
    }
}

fn cube(h: f64) -> Tessellation {
    let h = h as f32;
    let corner = |i: u32| [1, 2, 4].map(|bit| if i & bit == 0 { -h } else { h });
    Tessellation {
        points: (0..8).map(corner).collect(),
        face_size: 4,
        corner_points: vec![
            0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5,
        ],
        normals: None,
    }
}

fn plane(shape: &ImplicitShape<'_>) -> Tessellation {
    let half = plane_bounds(shape.axis, shape.dimensions[0], shape.dimensions[1]).max;
    let corner = |s: f64, t: f64| (half * on_axis(shape.axis, s, t, 0.0)).as_vec3().to_array();
    Tessellation {
        points: vec![
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ],
        face_size: 4,
        corner_points: vec![0, 1, 2, 3],
        normals: None,
    }
}

#[cfg(test)]
mod tests;
