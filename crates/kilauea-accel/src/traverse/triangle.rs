use super::tree_ray::TreeRay;
use crate::node::Leaf4;

/// Distance and weights of the second and third vertex where the ray's line meets the triangle in
/// `lane`; `None` if it passes by or lies in the plane.
///
/// Woop et al. 2013: the vertices are sheared into the plane across the ray in `f32`, alike for
/// all triangles that share one. The signs of the edge functions of those points decide, taken
/// from products that are exact in `f64`; so a line through an edge or a vertex of a closed mesh
/// cannot pass. The position is then found afresh in `f64` and kept within the triangle.
#[inline(always)]
pub(crate) fn intersect(leaf: &Leaf4, lane: usize, ray: &TreeRay) -> Option<[f32; 3]> {
    let [kx, ky, kz] = ray.axes;
    let corner = |vertex: usize| leaf.v[vertex].map(|axis| axis[lane]);

    // Decide.
    let [a, b, c] = [0, 1, 2].map(|vertex| {
        let p = corner(vertex);
        let along = p[kz] - ray.origin[kz];
        let x = (p[kx] - ray.origin[kx]) - ray.shear[0] * along;
        let y = (p[ky] - ray.origin[ky]) - ray.shear[1] * along;
        [f64::from(x), f64::from(y)]
    });
    let weights = edge_functions(a, b, c);
    let sum = weights[0] + weights[1] + weights[2];
    let inside = weights.iter().all(|&w| w >= 0.0) || weights.iter().all(|&w| w <= 0.0);
    if !inside || sum == 0.0 {
        return None;
    }

    // Locate.
    let rcp_largest = 1.0 / ray.dir_f64[kz];
    let [sx, sy] = [ray.dir_f64[kx] * rcp_largest, ray.dir_f64[ky] * rcp_largest];
    let [a, b, c] = [0, 1, 2].map(|vertex| {
        let p = corner(vertex).map(f64::from);
        let along = p[kz] - ray.origin_f64[kz];
        let x = (p[kx] - ray.origin_f64[kx]) - sx * along;
        let y = (p[ky] - ray.origin_f64[ky]) - sy * along;
        [x, y, along]
    });
    let exact = edge_functions([a[0], a[1]], [b[0], b[1]], [c[0], c[1]]);
    let exact_sum = exact[0] + exact[1] + exact[2];
    let sign = 1.0_f64.copysign(exact_sum);
    let mut weights_in = exact.map(|w| (w * sign).max(0.0));
    let mut sum_in = weights_in[0] + weights_in[1] + weights_in[2];
    if exact_sum == 0.0 || sum_in == 0.0 {
        // Seen edge-on but for the rounding that decided: stay with that rounding.
        weights_in = weights;
        sum_in = sum;
    }
    let scale = 1.0 / sum_in;
    let [wa, wb, wc] = weights_in;
    let along = (wa * a[2] + wb * b[2] + wc * c[2]) * scale;
    Some([along * rcp_largest, wb * scale, wc * scale].map(|x| x as f32))
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
