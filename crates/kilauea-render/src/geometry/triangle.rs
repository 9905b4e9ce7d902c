use kilauea_accel::SurfacePoint;
use kilauea_math::{DVec3, Vec3, each_of_three};
use kilauea_scene::MeshChunk;
use kilauea_shading::Element;

use super::interaction::View;
use super::keys::{between, key_before};
use super::placed::EngineTransform;
use super::shape_point::ShapePoint;

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
    each_of_three(chunk.triangles[triangle as usize], |v| {
        between(a[v as usize], b[v as usize], share)
    })
}

/// Shading normals of the corners in the chunk's space, at a time; none where faceted.
#[inline]
fn corner_normals(chunk: &MeshChunk, triangle: u32, time: f32) -> Option<[Vec3; 3]> {
    let first = chunk.normals.as_ref()?;
    let vertices = chunk.triangles[triangle as usize];
    if chunk.later_keys.is_empty() {
        let normal = |v: u32| Vec3::from_array(first[v as usize]);
        return Some(each_of_three(vertices, normal));
    }
    let (before, share) = key_before(chunk.later_keys.len() + 1, time);
    let key = |k: usize| match k {
        0 => Some(first),
        k => chunk.later_keys[k - 1].normals.as_ref(),
    };
    let (a, b) = (key(before)?, key(before + 1)?);
    Some(each_of_three(vertices, |v| {
        between(a[v as usize], b[v as usize], share)
    }))
}

/// A triangle at a moment, in its chunk's space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Triangle {
    /// In the chunk's winding.
    pub(crate) corners: [Vec3; 3],
    /// Shading normals of the corners; none where faceted.
    pub(crate) normals: Option<[Vec3; 3]>,
}

impl Triangle {
    #[inline]
    pub(super) fn of(chunk: &MeshChunk, triangle: u32, time: f32) -> Self {
        Self {
            corners: corners(chunk, triangle, time),
            normals: corner_normals(chunk, triangle, time),
        }
    }

    /// The point with the view's weights of the second and third corner.
    #[inline]
    pub(super) fn point(&self, transform: &EngineTransform, view: &View) -> ShapePoint {
        let corners = each_of_three(self.corners, |p| transform.exact_point(p));
        let (u, v) = (view.uv.x, view.uv.y);
        let w = 1.0 - u - v;
        let point = SurfacePoint::on_triangle(corners, u, v, transform.error());
        let ng = (point.ng * transform.handedness()).normalize_or(view.wo);
        let ns = match self.normals {
            None => ng,
            Some([na, nb, nc]) => {
                let ns = transform.normal(w * na + u * nb + v * nc).normalize_or(ng);
                if ns.dot(ng) < 0.0 { -ns } else { ns }
            }
        };
        ShapePoint {
            p: point.p,
            p_error: point.p_error,
            ng,
            ns,
            corners: each_of_three(corners, |p: DVec3| p.as_vec3()),
            barycentrics: view.uv,
            element: Element::Triangle {
                face: 0,
                vertices: [0, 1, 2],
            },
        }
    }
}
