use super::tree_ray::{Line, TreeRay};
use crate::node::LeafTriangle;

/// The shear that takes a ray's direction to its largest axis (Woop et al. 2013), in the arithmetic
/// that all kernels share.
#[derive(Clone, Copy)]
pub(crate) struct Shear {
    origin: [f32; 3],
    axes: [usize; 3],
    factors: [f32; 2],
}

impl Shear {
    pub(crate) fn of(ray: &TreeRay<impl Line>) -> Self {
        let axes = ray.axes();
        let [x, y, z] = axes.map(|axis| ray.dir[axis]);
        let rcp_largest = 1.0 / z;
        Self {
            origin: axes.map(|axis| ray.origin[axis]),
            axes,
            factors: [x * rcp_largest, y * rcp_largest],
        }
    }

    /// A point in the plane across the ray.
    pub(crate) fn of_point(&self, p: [f32; 3]) -> [f32; 2] {
        let [x, y, along] = [0, 1, 2].map(|i| p[self.axes[i]] - self.origin[i]);
        [x - self.factors[0] * along, y - self.factors[1] * along]
    }
}

/// Distance and weights of the second and third corner where the ray's line meets a triangle that
/// [`super::kernel::Kernel::candidates`] named; `None` if the line passes by or lies
/// in the plane.
///
/// Woop et al. 2013: the vertices are sheared into the plane across the ray in `f32`, alike for
/// all triangles that share one. The signs of the edge functions of those points decide, so a line
/// through an edge or a vertex of a closed mesh cannot pass. The position is found afresh in `f64`;
/// where it is outside, it is that of the nearest point of the edges.
#[inline(always)]
pub(crate) fn intersect(triangle: &LeafTriangle<'_>, ray: &TreeRay<impl Line>) -> Option<[f32; 3]> {
    let dir = ray.axes().map(|axis| ray.exact_dir(axis));
    let (a, a_along) = sheared_f64(triangle, 0, ray, dir);
    let (b, b_along) = sheared_f64(triangle, 1, ray, dir);
    let (c, c_along) = sheared_f64(triangle, 2, ray, dir);
    let mut weights = edge_functions(a, b, c);
    let least = weights[0].min(weights[1]).min(weights[2]);
    let most = weights[0].max(weights[1]).max(weights[2]);
    if least <= 0.0 && most >= 0.0 {
        let along = [a_along, b_along, c_along];
        if is_left_behind(weights, along, dir[2]) || !is_decided_inside(triangle, ray) {
            return None;
        }
        weights = nearest_on_edges([a, b, c]);
    }
    let along = [
        weights[0] * a_along,
        weights[1] * b_along,
        weights[2] * c_along,
    ];
    Some(weighted_mean(weights, along, dir[2]))
}

/// Distance and the last two weights of a mean, by weights of any sum and distances along the largest
/// axis times them.
#[inline(always)]
pub(crate) fn weighted_mean(weights: [f64; 3], along: [f64; 3], dir_largest: f64) -> [f32; 3] {
    let scale = 1.0 / ((weights[0] + weights[1] + weights[2]) * dir_largest);
    [
        ((along[0] + along[1] + along[2]) * scale) as f32,
        (weights[1] * dir_largest * scale) as f32,
        (weights[2] * dir_largest * scale) as f32,
    ]
}

/// Whether the line meets the triangle's plane near the triangle but before its origin: a ray that
/// left the triangle just beside an edge. The point of the triangle nearest to the line, which is
/// what a hit at the border gets, may lie ahead all the same.
#[cold]
fn is_left_behind(weights: [f64; 3], along: [f64; 3], dir_largest: f64) -> bool {
    let t_corners = along.map(|along| along / dir_largest);
    let t_least = t_corners[0].min(t_corners[1]).min(t_corners[2]);
    let weighted = |i: usize| weights[i] * t_corners[i];
    let t = (weighted(0) + weighted(1) + weighted(2)) / (weights[0] + weights[1] + weights[2]);
    t_least <= t && t <= 0.0
}

/// Whether the line that [`super::kernel::Kernel::candidates`] named passes inside by the signs on
/// which all triangles with a common corner agree.
#[cold]
fn is_decided_inside(triangle: &LeafTriangle<'_>, ray: &TreeRay<impl Line>) -> bool {
    // Products of `f32` are exact in `f64`: where the kernel found zero, this finds the sign.
    let shear = Shear::of(ray);
    let [a, b, c] = triangle
        .corners()
        .map(|corner| shear.of_point(corner).map(f64::from));
    let decisive = edge_functions(a, b, c);
    let inside = decisive.iter().all(|&w| w >= 0.0) || decisive.iter().all(|&w| w <= 0.0);
    inside && decisive != [0.0; 3]
}

/// Weights of the point on the edges that is nearest to the line, in the plane across it. (To drop
/// negative weights instead would move along a thin triangle by many times its width.)
#[cold]
fn nearest_on_edges(corners: [[f64; 2]; 3]) -> [f64; 3] {
    let mut nearest = (f64::INFINITY, [1.0, 0.0, 0.0]);
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        let (p, q) = (corners[i], corners[j]);
        let edge = [q[0] - p[0], q[1] - p[1]];
        let length2 = edge[0] * edge[0] + edge[1] * edge[1];
        let s = -(p[0] * edge[0] + p[1] * edge[1]) / length2.max(f64::MIN_POSITIVE);
        let s = s.clamp(0.0, 1.0);
        let (x, y) = (p[0] + s * edge[0], p[1] + s * edge[1]);
        let distance2 = x * x + y * y;
        if distance2 < nearest.0 {
            let mut weights = [0.0; 3];
            (weights[i], weights[j]) = (1.0 - s, s);
            nearest = (distance2, weights);
        }
    }
    nearest.1
}

/// A corner in the plane across the ray from its true origin, times the last component of `dir`,
/// which is sheared; and how far along the last axis.
#[inline(always)]
fn sheared_f64(
    triangle: &LeafTriangle<'_>,
    corner: usize,
    ray: &TreeRay<impl Line>,
    dir: [f64; 3],
) -> ([f64; 2], f64) {
    let from_origin = |axis| f64::from(triangle.coordinate(corner, axis)) - ray.exact_origin(axis);
    let [x, y, along] = ray.axes().map(from_origin);
    let sheared = [x * dir[2] - dir[0] * along, y * dir[2] - dir[1] * along];
    (sheared, along)
}

/// Twice the signed areas that the origin spans with the edges opposite to each corner.
#[inline(always)]
fn edge_functions(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> [f64; 3] {
    [
        c[0] * b[1] - c[1] * b[0],
        a[0] * c[1] - a[1] * c[0],
        b[0] * a[1] - b[1] * a[0],
    ]
}
