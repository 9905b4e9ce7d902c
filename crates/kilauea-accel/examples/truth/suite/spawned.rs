//! Rays that leave the surfaces that others met.

use super::oracle::{Oracle, border_width};
use super::rays::{Aimed, Must, Random};
use super::stage::Stage;
use kilauea_accel::{Hit, PlacementError, Ray, SurfacePoint};
use kilauea_math::{DAffine3, DVec3};

/// Least sine between surface and ray: below it, the rounding of a unit direction decides on which
/// side the ray runs.
const LEAST_SINE: f64 = 1e-6;

/// A ray off a surface, in a random direction to either side, often a grazing one.
pub(crate) fn leave(stage: &Stage, oracle: &Oracle, hit: &Hit, random: &mut Random) -> Aimed {
    let placement = hit.instance as usize;
    let corners = stage.corners(placement, hit.primitive);
    let world_from_geometry = &stage.placements[placement].world_from_geometry;
    let error = if *world_from_geometry == DAffine3::IDENTITY {
        PlacementError::NONE
    } else {
        PlacementError::of(world_from_geometry)
    };
    let point = SurfacePoint::on_triangle(corners, hit.u, hit.v, &error);

    let normal = (corners[1] - corners[0])
        .cross(corners[2] - corners[0])
        .normalize();
    let side = if random.unit() < 0.5 { normal } else { -normal };
    let tangent = random.point();
    let tangent = (tangent - tangent.dot(normal) * normal).normalize_or(corners[1] - corners[0]);
    let sine = match random.index(2) {
        0 => random.decade(LEAST_SINE.log10() + 0.3, -1.0),
        _ => random.unit().sqrt().max(0.1),
    };
    let dir = (side * sine + tangent * (1.0 - sine * sine).sqrt()).as_vec3();
    let origin = point.offset_origin(dir);
    let is_held = stage.insides.iter().any(|inside| {
        inside.placement == placement
            && is_off_edges(&point, corners, hit)
            && oracle.is_free(hit.instance, origin.as_dvec3(), inside.center)
    });
    let must = if is_held {
        Must::Hit(f64::INFINITY)
    } else {
        Must::Either
    };
    Aimed {
        ray: Ray::new(origin, dir),
        must,
    }
}

/// Whether the point is further from its triangle's edges than the kernels may err: across an edge
/// the mesh goes on to either side of the point.
fn is_off_edges(point: &SurfacePoint, [a, b, c]: [DVec3; 3], hit: &Hit) -> bool {
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let double_area = (b - a).cross(c - a).length();
    let least_weight = hit.u.min(hit.v).min(1.0 - hit.u - hit.v);
    let from_edges = f64::from(least_weight) * double_area / longest;
    let moved = f64::from(point.p_error.max_element() + f32::EPSILON * point.p.abs().max_element());
    from_edges > 4.0 * (moved + border_width(longest))
}
