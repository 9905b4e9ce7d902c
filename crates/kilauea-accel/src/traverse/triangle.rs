use super::tree_ray::TreeRay;
use crate::node::LeafTriangle;

/// Distance and weights of the second and third corner where the ray's line meets a triangle that
/// [`super::kernel::Kernel::candidates`] named; `None` if the line passes by or lies
/// in the plane.
///
/// Woop et al. 2013: the vertices are sheared into the plane across the ray in `f32`, alike for
/// all triangles that share one. The signs of the edge functions of those points decide, so a line
/// through an edge or a vertex of a closed mesh cannot pass. The position is found afresh in `f64`
/// and kept within the triangle.
#[inline(always)]
pub(crate) fn intersect(triangle: &LeafTriangle<'_>, ray: &TreeRay) -> Option<[f32; 3]> {
    let [kx, ky, kz] = ray.axes;
    let rcp_largest = 1.0 / ray.dir_f64[kz];
    let shear = [ray.dir_f64[kx] * rcp_largest, ray.dir_f64[ky] * rcp_largest];
    let (a, a_along) = sheared_f64(triangle, 0, ray, shear);
    let (b, b_along) = sheared_f64(triangle, 1, ray, shear);
    let (c, c_along) = sheared_f64(triangle, 2, ray, shear);
    let mut weights = edge_functions(a, b, c);
    let least = weights[0].min(weights[1]).min(weights[2]);
    let most = weights[0].max(weights[1]).max(weights[2]);
    if least <= 0.0 && most >= 0.0 {
        weights = weights_at_border(triangle, ray, weights)?;
    }
    let [wa, wb, wc] = weights;
    let scale = 1.0 / (wa + wb + wc);
    let along = (wa * a_along + wb * b_along + wc * c_along) * scale;
    Some([
        (along * rcp_largest) as f32,
        (wb * scale) as f32,
        (wc * scale) as f32,
    ])
}

/// Weights, none of them negative, of a triangle that the line does not clearly pass through;
/// `exact` says where it would be outside.
#[cold]
fn weights_at_border(
    triangle: &LeafTriangle<'_>,
    ray: &TreeRay,
    exact: [f64; 3],
) -> Option<[f64; 3]> {
    // Products of `f32` are exact in `f64`: where the kernel found zero, this finds the sign.
    let [a, b, c] = triangle
        .corners()
        .map(|corner| ray.sheared(corner).map(f64::from));
    let decisive = edge_functions(a, b, c);
    let inside = decisive.iter().all(|&w| w >= 0.0) || decisive.iter().all(|&w| w <= 0.0);
    if !inside || decisive == [0.0; 3] {
        return None;
    }
    let sign = 1.0_f64.copysign(exact[0] + exact[1] + exact[2]);
    let kept = exact.map(|w| (w * sign).max(0.0));
    if kept == [0.0; 3] {
        // Seen edge-on but for the rounding that decided: stay with that rounding.
        return Some(decisive.map(f64::abs));
    }
    Some(kept)
}

/// A corner in the plane across the ray from its true origin, and how far along the last axis.
#[inline(always)]
fn sheared_f64(
    triangle: &LeafTriangle<'_>,
    corner: usize,
    ray: &TreeRay,
    shear: [f64; 2],
) -> ([f64; 2], f64) {
    let [kx, ky, kz] = ray.axes;
    let x = f64::from(triangle.coordinate(corner, kx)) - ray.origin_f64[kx];
    let y = f64::from(triangle.coordinate(corner, ky)) - ray.origin_f64[ky];
    let along = f64::from(triangle.coordinate(corner, kz)) - ray.origin_f64[kz];
    ([x - shear[0] * along, y - shear[1] * along], along)
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
