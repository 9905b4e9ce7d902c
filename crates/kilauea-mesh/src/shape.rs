use kilauea_math::{DAffine3, DVec3};
use kilauea_scene::Visibility;

use crate::bounds::{DBounds, is_singular};
use crate::curves::{CheckedCurves, check_curves};
use crate::implicit::{check_dimensions, shape_bounds};
use crate::instancing::Plan;
use crate::payload::{BasisCurves, ImplicitShape, Payloads, Points, PolyMesh};
use crate::polygon::{Topology, check_topology};
use crate::report::Report;
use crate::surface::is_placeable;

/// Anything that is drawn.
pub(crate) enum Shape<'p, 'a> {
    Mesh(&'p PolyMesh<'a>),
    Implicit(&'p ImplicitShape<'a>),
    Curves(&'p BasisCurves<'a>),
    Points(&'p Points<'a>),
}

impl Shape<'_, '_> {
    pub(crate) fn path(&self) -> &str {
        match self {
            Self::Mesh(mesh) => mesh.path,
            Self::Implicit(shape) => shape.path,
            Self::Curves(curves) => curves.path,
            Self::Points(points) => points.path,
        }
    }

    pub(crate) fn prototype(&self) -> u32 {
        match self {
            Self::Mesh(mesh) => mesh.prototype,
            Self::Implicit(shape) => shape.prototype,
            Self::Curves(curves) => curves.prototype,
            Self::Points(points) => points.prototype,
        }
    }

    pub(crate) fn visibility(&self) -> Visibility {
        match self {
            Self::Mesh(mesh) => mesh.visibility,
            Self::Implicit(shape) => shape.visibility,
            Self::Curves(curves) => curves.visibility,
            Self::Points(points) => points.visibility,
        }
    }

    pub(crate) fn is_double_sided(&self) -> bool {
        match self {
            Self::Mesh(mesh) => mesh.double_sided,
            Self::Implicit(shape) => shape.double_sided,
            Self::Curves(_) | Self::Points(_) => true,
        }
    }

    fn prototype_from_shape(&self) -> DAffine3 {
        match self {
            Self::Mesh(mesh) => mesh.prototype_from_mesh,
            Self::Implicit(shape) => shape.prototype_from_mesh,
            Self::Curves(curves) => curves.prototype_from_curves,
            Self::Points(points) => points.prototype_from_points,
        }
    }
}

/// Everything that is drawn, in the order of primIds.
pub(crate) fn all_shapes<'p, 'a>(payloads: &'p Payloads<'a>) -> Vec<Shape<'p, 'a>> {
    let meshes = payloads.meshes.iter().map(Shape::Mesh);
    meshes
        .chain(payloads.implicits.iter().map(Shape::Implicit))
        .chain(payloads.curves.iter().map(Shape::Curves))
        .chain(payloads.points.iter().map(Shape::Points))
        .collect()
}

/// A shape that will be drawn, and where.
pub(crate) struct Located<'a> {
    /// Scene prototype that holds it.
    pub(crate) root: usize,
    pub(crate) root_from_shape: DAffine3,
    /// In its own space, at all motion keys.
    pub(crate) bounds: DBounds,
    /// In the prototype's space.
    pub(crate) root_bounds: DBounds,
    pub(crate) checked: Checked<'a>,
    /// Points of a mesh that are not finite.
    pub(crate) n_bad_points: usize,
}

/// What was found out about a shape's arrays.
pub(crate) enum Checked<'a> {
    Mesh(Topology<'a>),
    Curves(CheckedCurves),
    /// Nothing that would be needed again.
    Other,
}

/// Checks a shape and finds its place and size; absent if there is nothing to draw.
pub(crate) fn locate<'a>(
    shape: &Shape<'_, 'a>,
    plan: &Plan,
    report: &mut Report,
) -> Option<Located<'a>> {
    let home = plan.homes[shape.prototype() as usize].as_ref()?;
    let root_from_shape = home.root_from_prototype * shape.prototype_from_shape();
    if is_singular(&root_from_shape) {
        let what = "of no extent or not finite; prim skipped";
        report.warn(shape.path(), "transform", what);
        return None;
    }
    let mut located = Located {
        root: home.root,
        root_from_shape,
        bounds: DBounds::EMPTY,
        root_bounds: DBounds::EMPTY,
        checked: Checked::Other,
        n_bad_points: 0,
    };
    match shape {
        Shape::Implicit(shape) => {
            if !check_dimensions(shape, report) {
                return None;
            }
            located.bounds = shape_bounds(shape);
            located.root_bounds = located.bounds.transformed(&root_from_shape);
        }
        Shape::Mesh(mesh) => {
            located.checked = Checked::Mesh(check_topology(mesh, report)?);
            located.n_bad_points = located.include(mesh.points);
            for key in &mesh.later_keys {
                located.include(key.points);
            }
        }
        Shape::Curves(curves) => {
            let checked = check_curves(curves, &root_from_shape, report)?;
            for range in checked.point_ranges() {
                located.include(&curves.points[range.clone()]);
                for key in &curves.later_points {
                    located.include(key.get(range.clone()).unwrap_or_default());
                }
            }
            located.checked = Checked::Curves(checked);
        }
        Shape::Points(points) => {
            located.include(points.points);
            for key in &points.later_points {
                located.include(key);
            }
        }
    }
    let corners = [located.root_bounds.min, located.root_bounds.max];
    if !located.root_bounds.is_empty() && !corners.into_iter().all(is_placeable) {
        report.warn(shape.path(), "transform", "too large; prim skipped");
        return None;
    }
    Some(located)
}

impl Located<'_> {
    /// Widens the bounds by all points that can be placed; returns how many cannot.
    fn include(&mut self, points: &[[f32; 3]]) -> usize {
        let mut n_bad_points = 0;
        for p in points {
            let p = DVec3::from_array(p.map(f64::from));
            let p_root = self.root_from_shape.transform_point3(p);
            if is_placeable(p) && is_placeable(p_root) {
                self.bounds.include(p);
                self.root_bounds.include(p_root);
            } else {
                n_bad_points += 1;
            }
        }
        n_bad_points
    }
}
