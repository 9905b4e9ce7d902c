use kilauea_math::{Vec2, Vec3};
use kilauea_shading::Element;

/// What is known of a point on a primitive, engine space.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShapePoint {
    pub(super) p: Vec3,
    /// By axis: how far `p` may be from the surface that rays are tested against.
    pub(super) p_error: Vec3,
    /// Geometric normal, to the outside.
    pub(super) ng: Vec3,
    /// Shading normal, on the same side.
    pub(super) ns: Vec3,
    /// As [`kilauea_shading::Surface::corners`] has them.
    pub(super) corners: [Vec3; 3],
    pub(super) barycentrics: Vec2,
    pub(super) element: Element,
}

/// The largest coordinate.
#[inline]
pub(super) fn extent(p: Vec3) -> f32 {
    p.abs().max_element()
}
