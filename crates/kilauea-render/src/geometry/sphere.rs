use kilauea_math::{Vec2, Vec3, gamma};
use kilauea_scene::PointsChunk;
use kilauea_shading::Element;

use super::interaction::View;
use super::keys::{between, key_before};
use super::placed::EngineTransform;
use super::shape_point::{ShapePoint, extent};

fn center(chunk: &PointsChunk, idx: usize, time: f32) -> Vec3 {
    if chunk.later_centers.is_empty() {
        return Vec3::from_array(chunk.centers[idx]);
    }
    let (before, share) = key_before(chunk.later_centers.len() + 1, time);
    let key = |k: usize| match k {
        0 => &chunk.centers,
        k => &chunk.later_centers[k - 1],
    };
    between(key(before)[idx], key(before + 1)[idx], share)
}

/// A ball at a moment, in the chunk's space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ball {
    pub(crate) center: Vec3,
    pub(crate) radius: f32,
}

impl Ball {
    pub(super) fn of(chunk: &PointsChunk, idx: u32, time: f32) -> Self {
        Self {
            center: center(chunk, idx as usize, time),
            radius: chunk.radii[idx as usize],
        }
    }

    /// The point of the sphere that is nearest to where the ray found it.
    pub(super) fn point(&self, transform: &EngineTransform, view: &View) -> ShapePoint {
        let (p, ng, p_error) = self.point_and_normal(transform, view);
        let (tangent, bitangent) = ng.any_orthonormal_pair();
        ShapePoint {
            p,
            p_error: Vec3::splat(p_error),
            ng,
            ns: ng,
            corners: [p, p + tangent, p + bitangent],
            barycentrics: Vec2::ZERO,
            element: Element::Point(0),
        }
    }

    /// Point, unit normal and error bound of all axes, engine space: the ray's point, put onto the surface.
    pub(super) fn point_and_normal(
        &self,
        transform: &EngineTransform,
        view: &View,
    ) -> (Vec3, Vec3, f32) {
        let toward = transform.point_of_chunk(view.p_ray) - self.center;
        let n_chunk = toward.normalize_or(Vec3::Z);
        let p = transform.point(self.center + self.radius * n_chunk);
        let ng = transform.normal(n_chunk).normalize_or(view.wo);
        let size = extent(self.center) + self.radius;
        let size = size.max(extent(p)) + transform.reach();
        (p, ng, gamma(16) * size)
    }
}
