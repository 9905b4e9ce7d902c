//! Segments of straight curves.

use super::ray_frame::{Place, RayFrame};

/// First and last value along a segment: x, y, z in a ray's frame, and radius.
pub(crate) type Ends = [[f64; 2]; 4];

#[inline]
fn at([from, to]: [f64; 2], u: f64) -> f64 {
    from + u * (to - from)
}

/// A round segment: all balls between the ends, a cone tangent to two spheres. Neighbours share a
/// ball, so joints have no gaps.
pub(crate) fn intersect_round(segment: &Ends, ray: &RayFrame) -> Option<Place> {
    // The solid is convex: the line enters it at the least depth of its balls, and leaves it at
    // the largest, the least of the mirror image.
    let [x, y, z, r] = *segment;
    let entry = nearest_ball(segment)?;
    let found = if entry[0] > ray.start() {
        entry
    } else {
        let [depth, u] = nearest_ball(&[x, y, z.map(|z| -z), r])?;
        [-depth, u]
    };
    (found[0] > ray.start()).then(|| Place {
        t: ray.distance(found[0]),
        u: found[1],
        v: 0.0,
    })
}

/// Depth and parameter of the ball that the line enters first: one of the ends or, where
/// g = z - √h turns, one between.
fn nearest_ball(segment: &Ends) -> Option<[f64; 2]> {
    let [x, y, z, r] = *segment;
    let entry = |u: f64| {
        let (x, y, r) = (at(x, u), at(y, u), at(r, u));
        let h = r * r - (x * x + y * y);
        (h >= 0.0).then(|| [at(z, u) - h.sqrt(), u])
    };
    let turn = turn(segment).filter(|u| (0.0..=1.0).contains(u));
    [Some(0.0), turn, Some(1.0)]
        .into_iter()
        .flatten()
        .filter_map(entry)
        .min_by(|a, b| a[0].total_cmp(&b[0]))
}

/// Where g' = 0. With h = a u² + b u + c and z' constant, h' = 2 z' √h there; squared, that is a
/// quadratic in u, of which one root has the right sign.
fn turn(segment: &Ends) -> Option<f64> {
    let [x, y, _, r] = *segment;
    let [dx, dy, dz, dr] = segment.map(|[from, to]| to - from);
    let a = dr * dr - (dx * dx + dy * dy);
    let b = 2.0 * (r[0] * dr - (x[0] * dx + y[0] * dy));
    let c = r[0] * r[0] - (x[0] * x[0] + y[0] * y[0]);
    let excess = dz * dz - a;
    let square = (b * b - 4.0 * a * c) / excess;
    if square.is_nan() || square < 0.0 {
        return None;
    }
    let root = dz * square.sqrt();
    // Of both forms of the root the one that adds numbers of like sign.
    Some(if root * b <= 0.0 {
        (root - b) / (2.0 * a)
    } else {
        (b * b - 4.0 * c * dz * dz) / (2.0 * excess * (b + root))
    })
}

/// A flat segment that faces the ray: the points nearest to the line, with a half disc at each end
/// that closes joints.
pub(crate) fn intersect_facing(segment: &Ends, ray: &RayFrame) -> Option<Place> {
    let [x, y, z, r] = *segment;
    let (dx, dy) = (x[1] - x[0], y[1] - y[0]);
    let length_squared = dx * dx + dy * dy;
    let foot = -(x[0] * dx + y[0] * dy) / length_squared;
    // A segment seen end-on shows its first end.
    let u = if foot.is_nan() {
        0.0
    } else {
        foot.clamp(0.0, 1.0)
    };
    let (x, y, depth, radius) = (at(x, u), at(y, u), at(z, u), at(r, u));
    let distance_squared = x * x + y * y;
    if distance_squared > radius * radius || depth <= ray.start() {
        return None;
    }
    let side = 1.0_f64.copysign(x * dy - y * dx);
    Some(Place {
        t: ray.distance(depth),
        u,
        v: 0.5 - 0.5 * side * (distance_squared.sqrt() / radius).min(1.0),
    })
}

#[cfg(test)]
mod tests;
