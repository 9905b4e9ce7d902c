use kilauea_math::{Vec3, gamma};
use kilauea_scene::MeshChunk;
use kilauea_shading::Element;

use super::interaction::View;
use super::keys::{between, key_before};
use super::placed::EngineTransform;
use super::shape_point::{ShapePoint, extent};

/// Corner points in the chunk's space and winding, at a time.
#[inline]
pub(super) fn corners(chunk: &MeshChunk, triangle: u32, time: f32) -> [Vec3; 3] {
    if chunk.later_keys.is_empty() {
        return chunk.corners(triangle as usize);
    }
    let (before, share) = key_before(chunk.later_keys.len() + 1, time);
    let key = |k: usize| match k {
        0 => &chunk.positions,
        k => &chunk.later_keys[k - 1].positions,
    };
    let (a, b) = (key(before), key(before + 1));
    chunk.triangles[triangle as usize].map(|v| between(a[v as usize], b[v as usize], share))
}

/// Shading normals of the corners in the chunk's space, at a time; none where faceted.
#[inline]
fn corner_normals(chunk: &MeshChunk, triangle: u32, time: f32) -> Option<[Vec3; 3]> {
    let first = chunk.normals.as_ref()?;
    let vertices = chunk.triangles[triangle as usize];
    if chunk.later_keys.is_empty() {
        return Some(vertices.map(|v| Vec3::from_array(first[v as usize])));
    }
    let (before, share) = key_before(chunk.later_keys.len() + 1, time);
    let key = |k: usize| match k {
        0 => Some(first),
        k => chunk.later_keys[k - 1].normals.as_ref(),
    };
    let (a, b) = (key(before)?, key(before + 1)?);
    Some(vertices.map(|v| between(a[v as usize], b[v as usize], share)))
}

/// The point with the view's weights of the second and third corner.
#[inline]
pub(super) fn triangle_point(
    chunk: &MeshChunk,
    triangle: u32,
    transform: &EngineTransform,
    view: &View,
) -> ShapePoint {
    let corners = corners(chunk, triangle, view.time).map(|p| transform.point(p));
    let [a, b, c] = corners;
    let (u, v) = (view.uv.x, view.uv.y);
    let w = 1.0 - u - v;
    // Rounding of the interpolation, also between motion keys, of the placement, and of the next
    // ray's intersection with this same triangle. One bound serves all axes: the shear of the
    // triangle test mixes them, so that a coordinate of zero is no more exact than the others.
    let n_roundings = if chunk.later_keys.is_empty() { 10 } else { 14 };
    let p_error =
        gamma(n_roundings) * extent(a).max(extent(b)).max(extent(c)) + gamma(6) * transform.reach();
    let ng = ((b - a).cross(c - a) * transform.handedness()).normalize_or(view.wo);
    let ns = match corner_normals(chunk, triangle, view.time) {
        None => ng,
        Some([na, nb, nc]) => {
            let ns = transform.normal(w * na + u * nb + v * nc).normalize_or(ng);
            if ns.dot(ng) < 0.0 { -ns } else { ns }
        }
    };
    ShapePoint {
        p: w * a + u * b + v * c,
        p_error,
        ng,
        ns,
        corners,
        barycentrics: view.uv,
        element: Element::triangle(chunk, triangle),
    }
}
