use super::stack::{Links, Storage};
use super::tree_ray::{Line, TreeRay};
use super::triangle;
use crate::node::{Node8, PairLeaf};

/// A number for each lane of a node or leaf.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub(crate) struct Lanes(pub(crate) [f32; 8]);

/// Bounds on distances, by lane.
#[derive(Clone, Copy)]
pub(crate) struct Distances {
    /// Not beyond the hit.
    pub(crate) nearest: Lanes,
    /// Not before it.
    pub(crate) furthest: Lanes,
}

impl Distances {
    pub(crate) const NONE: Self = Self {
        nearest: Lanes([0.0; 8]),
        furthest: Lanes([0.0; 8]),
    };
}

/// What a kernel can say of the triangles of a leaf.
#[derive(Clone, Copy)]
pub(crate) struct Candidates {
    /// Lanes whose triangles the line may pass through within the range: none is missing that it
    /// passes through by the signs of the watertight edge functions.
    pub(crate) possible: u32,
    /// Those that are hit for certain, whatever was rounded.
    pub(crate) certain: u32,
}

/// The arithmetic that differs between processors. Every kernel gives the same bits.
pub(crate) trait Kernel: Copy {
    /// The ray spread over eight lanes.
    type NodeRay: Copy;
    /// The ray spread over eight lanes, sheared.
    type LeafRay: Copy;
    /// Whether rays go much like those before them.
    const COHERENT: bool;
    /// What the stack is kept in.
    type Storage: Storage;
    /// What the stack of a walk in no order is kept in.
    type Links: Links;

    /// Spreads what the box test reads.
    fn node_ray(self, ray: &TreeRay<impl Line>) -> Self::NodeRay;

    /// Spreads what the triangle test reads.
    fn leaf_ray(self, ray: &TreeRay<impl Line>) -> Self::LeafRay;

    /// Robust slab test of eight boxes within `limit`: the lanes hit, and where each is entered
    /// (never later than the true entry).
    fn slabs(self, ray: &Self::NodeRay, limit: f32, node: &Node8) -> (u32, Lanes);

    /// The triangles that the line may meet within `limit`; [`Self::position`] decides
    /// on those that are not certain, and finds where. Writes `distances` if any is certain.
    fn candidates(
        self,
        ray: &Self::LeafRay,
        limit: f32,
        leaf: &PairLeaf,
        distances: &mut Distances,
    ) -> Candidates;

    /// Where the ray meets the triangle of a lane, as [`triangle::intersect`] finds it.
    #[inline(always)]
    fn position(
        self,
        (ray, _): (&TreeRay<impl Line>, &Self::LeafRay),
        leaf: &PairLeaf,
        lane: usize,
    ) -> Option<[f32; 3]> {
        triangle::intersect(&leaf.lane(lane), ray)
    }

    /// The same by a call, for where that is rarely asked.
    #[inline(always)]
    fn position_apart(
        self,
        rays: (&TreeRay<impl Line>, &Self::LeafRay),
        leaf: &PairLeaf,
        lane: usize,
    ) -> Option<[f32; 3]> {
        self.position(rays, leaf, lane)
    }

    /// The lowest lane of a mask. `PREDICTED` is whether the processor should go on with a guess
    /// before it has the mask.
    #[inline(always)]
    fn first_lane<const PREDICTED: bool>(self, mask: u32) -> usize {
        (mask.trailing_zeros() & 7) as usize
    }

    /// The highest lane of a mask that is not empty, which the processor may guess.
    #[inline(always)]
    fn last_lane(self, mask: u32) -> usize {
        (mask.ilog2() & 7) as usize
    }

    /// The item that a link of the tree names.
    fn item<T>(self, items: &[T], link: u32) -> &T;

    /// Begins to load the four cache lines at an address.
    fn prefetch(self, address: *const u8);
}
