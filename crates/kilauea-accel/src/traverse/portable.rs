//! Kernels in plain Rust: the reference that the others equal bit for bit.

use super::kernel::{Candidates, Distances, Kernel, Lanes};
use super::stack::Entry;
use super::tree_ray::{Line, SLAB_SLACK, TreeRay};
use super::triangle::Shear;
use super::two_level::{self, Scene};
use super::walk::Visitor;
use crate::node::{Node8, PairLeaf, STACK_CAPACITY};
use crate::ray::{Hit, Ray};

/// The kernels that every processor has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Portable;

/// Compiled once for all kinds of rays and of hits to keep: these walks take long to compile, and
/// processors that need them are slow anyway.
impl Portable {
    pub(crate) fn closest(
        self,
        scene: Scene<'_>,
        ray: &Ray,
        tree_ray: TreeRay,
        keep: KeepDyn<'_>,
    ) -> Option<Hit> {
        two_level::closest(self, scene, (ray, || tree_ray), keep)
    }

    pub(crate) fn occluded(
        self,
        scene: Scene<'_>,
        ray: &Ray,
        tree_ray: TreeRay,
        keep: KeepDyn<'_>,
    ) -> bool {
        two_level::occluded(self, scene, (ray, || tree_ray), keep)
    }

    pub(crate) fn pierce<L: Line>(
        self,
        nodes: &[Node8],
        ray: &TreeRay<L>,
        visitor: &mut impl Visitor,
    ) {
        two_level::pierce(self, nodes, ray, visitor);
    }
}

type KeepDyn<'a> = &'a mut dyn FnMut(&Hit) -> bool;

/// See [`Kernel::NodeRay`].
#[derive(Clone, Copy)]
pub(crate) struct NodeRay {
    origin: [f32; 3],
    near_rcp: [f32; 3],
    far_rcp: [f32; 3],
    /// Row of the plane that the ray meets first, by axis; the last is this with bit 0 flipped.
    near_plane: [usize; 3],
    t_min: f32,
}

impl Kernel for Portable {
    const COHERENT: bool = false;
    type NodeRay = NodeRay;
    type LeafRay = Shear;
    type Storage = [Entry; STACK_CAPACITY];
    type Links = [u32; STACK_CAPACITY];

    fn node_ray(self, ray: &TreeRay<impl Line>) -> NodeRay {
        let rcp = ray.rcp();
        let near_plane = |axis: usize| 2 * axis + usize::from(ray.dir[axis].is_sign_negative());
        NodeRay {
            origin: ray.origin.to_array(),
            near_rcp: (rcp * (1.0 - SLAB_SLACK)).to_array(),
            far_rcp: (rcp * (1.0 + SLAB_SLACK)).to_array(),
            near_plane: [near_plane(0), near_plane(1), near_plane(2)],
            t_min: ray.t_min,
        }
    }

    fn leaf_ray(self, ray: &TreeRay<impl Line>) -> Shear {
        Shear::of(ray)
    }

    fn slabs(self, ray: &NodeRay, limit: f32, node: &Node8) -> (u32, Lanes) {
        let mut near = [ray.t_min; 8];
        let mut far = [limit; 8];
        for axis in 0..3 {
            let near_plane = &node.planes[ray.near_plane[axis]];
            let far_plane = &node.planes[ray.near_plane[axis] ^ 1];
            for lane in 0..8 {
                let t_near = (near_plane[lane] - ray.origin[axis]) * ray.near_rcp[axis];
                let t_far = (far_plane[lane] - ray.origin[axis]) * ray.far_rcp[axis];
                near[lane] = near[lane].max(t_near);
                far[lane] = far[lane].min(t_far);
            }
        }
        let hit = (0..8).fold(0, |mask, lane| {
            mask | u32::from(near[lane] <= far[lane]) << lane
        });
        (hit, Lanes(near))
    }

    /// Leaves all that is not plainly outside to the exact test.
    fn candidates(
        self,
        ray: &Shear,
        _limit: f32,
        leaf: &PairLeaf,
        _distances: &mut Distances,
    ) -> Candidates {
        let mut possible = 0;
        for lane in 0..8 {
            let rows = if lane < 4 { [0, 1, 2] } else { [0, 2, 3] };
            let [a, b, c] = rows.map(|row| {
                let p = [0, 1, 2].map(|axis| leaf.corners[axis][row][lane & 3]);
                ray.of_point(p)
            });
            let edges = [
                c[0] * b[1] - c[1] * b[0],
                a[0] * c[1] - a[1] * c[0],
                b[0] * a[1] - b[1] * a[0],
            ];
            let inside = edges.iter().all(|&e| e >= 0.0) || edges.iter().all(|&e| e <= 0.0);
            possible |= u32::from(inside) << lane;
        }
        Candidates {
            possible,
            certain: 0,
        }
    }

    fn item<T>(self, items: &[T], link: u32) -> &T {
        &items[link as usize]
    }

    fn prefetch(self, _address: *const u8) {}
}
