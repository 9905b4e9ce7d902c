use crate::build::build_top;
use crate::node::Node8;
use crate::ray::Ray;
use crate::traverse::{Isa, TreeRay, Visitor};
use kilauea_math::Bounds3;
use obvhs::aabb::Aabb;

/// A small tree over boxes, which tells those that a ray pierces: whom to ask of those who hold
/// what is inside.
///
/// The test is that of the trees over primitives, with the same slack: no ray misses the box of
/// something that it hits.
#[derive(Clone, Debug)]
pub struct BoxTree {
    isa: Isa,
    nodes: Vec<Node8>,
}

impl BoxTree {
    /// Builds the tree; boxes are known by their number.
    pub fn build(boxes: &[Bounds3]) -> Self {
        let aabb = |bounds: &Bounds3| Aabb::new(bounds.min.into(), bounds.max.into());
        Self {
            isa: Isa::detect(true),
            nodes: build_top(boxes.iter().map(aabb).collect()),
        }
    }

    /// Calls `visit` for boxes that the ray pierces within its range, in any order, until that
    /// returns true. False if `ray` cannot be tested against boxes, as it is extreme or none.
    #[must_use]
    #[inline]
    pub fn visit_pierced(&self, ray: &Ray, visit: impl FnMut(u32) -> bool) -> bool {
        if !ray.is_moderate() {
            return false;
        }
        let limit = ray.t_max * (1.0 + 2.0 * f32::EPSILON);
        let mut visitor = Boxes { limit, visit };
        let tree_ray = TreeRay::world(ray.line(), ray.t_min);
        self.isa.pierce(&self.nodes, &tree_ray, &mut visitor);
        true
    }

    /// Bytes held.
    pub fn n_bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice())
    }
}

/// Leaves of boxes.
struct Boxes<F> {
    limit: f32,
    visit: F,
}

impl<F: FnMut(u32) -> bool> Visitor for Boxes<F> {
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.limit
    }

    #[inline(always)]
    fn visit(&mut self, leaf: u32) -> bool {
        (self.visit)(leaf)
    }

    /// Nothing is read at the leaves.
    #[inline(always)]
    fn address(&self, _: u32) -> *const u8 {
        std::ptr::null()
    }
}
