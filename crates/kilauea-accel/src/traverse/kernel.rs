use super::stack::Storage;
use super::tree_ray::TreeRay;
use crate::node::{Node8, PairLeaf};

/// Distances at which a ray enters the eight boxes of a node.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub(crate) struct Entries(pub(crate) [f32; 8]);

/// The arithmetic that differs between processors. Every kernel gives the same bits.
pub(crate) trait Kernel: Copy {
    /// The ray spread over eight lanes.
    type NodeRay: Copy;
    /// The ray spread over eight lanes, sheared.
    type LeafRay: Copy;
    /// What the stack is kept in.
    type Storage: Storage;

    /// Spreads what the box test reads.
    fn node_ray(self, ray: &TreeRay) -> Self::NodeRay;

    /// Spreads what the triangle test reads.
    fn leaf_ray(self, ray: &TreeRay) -> Self::LeafRay;

    /// Robust slab test of eight boxes within `limit`: the lanes hit, and where each is entered
    /// (never later than the true entry).
    fn slabs(self, ray: &Self::NodeRay, limit: f32, node: &Node8) -> (u32, Entries);

    /// The lanes whose triangles the line may pass through, by the signs of the watertight edge
    /// functions, less those that it certainly meets outside the range that ends at `limit`;
    /// [`super::triangle::intersect`] decides.
    fn candidates(self, ray: &Self::LeafRay, limit: f32, leaf: &PairLeaf) -> u32;

    /// The item that a link of the tree names.
    fn item<T>(self, items: &[T], link: u32) -> &T;

    /// Begins to load the four cache lines at an address.
    fn prefetch(self, address: *const u8);
}
