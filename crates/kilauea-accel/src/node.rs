//! The tree as the kernels read it.

use crate::motion::lerp;
use crate::ray::{Hit, PrimitiveId};
use kilauea_math::{Bounds3, Vec3};
use std::ops::Deref;

/// Marks a child link as a leaf block (or an instance, in the top tree).
pub(crate) const LEAF: u32 = 1 << 31;
/// The link of an unused lane.
pub(crate) const EMPTY: u32 = u32::MAX;
/// Entries of the traversal stack; builds keep every tree within it.
pub(crate) const STACK_CAPACITY: usize = 512;

/// The bounds of up to eight children, one lane each.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Node8 {
    /// Low x, high x, low y, high y, low z, high z. Unused lanes hold an inverted infinite box.
    pub(crate) planes: [[f32; 8]; 6],
    /// Node index, or leaf index with [`LEAF`], or [`EMPTY`].
    pub(crate) child: [u32; 8],
    /// Rounds the node up to four cache lines.
    pub(crate) unused: [u32; 8],
}

impl Node8 {
    pub(crate) const NONE: Self = Self {
        planes: [
            [f32::INFINITY; 8],
            [f32::NEG_INFINITY; 8],
            [f32::INFINITY; 8],
            [f32::NEG_INFINITY; 8],
            [f32::INFINITY; 8],
            [f32::NEG_INFINITY; 8],
        ],
        child: [EMPTY; 8],
        unused: [0; 8],
    };

    /// The lanes with a child.
    pub(crate) fn used_lanes(&self) -> impl Iterator<Item = usize> {
        (0..8).filter(|&lane| self.child[lane] != EMPTY)
    }

    /// A box around all children.
    pub(crate) fn bounds(&self) -> Bounds3 {
        self.used_lanes().fold(Bounds3::EMPTY, |bounds, lane| {
            let (min, max) = self.lane_bounds(lane);
            bounds.union(&Bounds3 {
                min: Vec3::from_array(min),
                max: Vec3::from_array(max),
            })
        })
    }

    /// Lowest and highest corner of a lane.
    pub(crate) fn lane_bounds(&self, lane: usize) -> ([f32; 3], [f32; 3]) {
        (
            [0, 1, 2].map(|axis| self.planes[2 * axis][lane]),
            [0, 1, 2].map(|axis| self.planes[2 * axis + 1][lane]),
        )
    }
}

/// Nodes that a walk can go through.
pub(crate) trait WalkNode: Sized {
    /// The node at a moment.
    type Still<'a>: Deref<Target = Node8>
    where
        Self: 'a;

    /// The node at a fraction of the interval between two motion keys.
    fn at(&self, fraction: f32) -> Self::Still<'_>;

    /// The nodes of a tree whose links are those of `nodes`; `leaf_boxes` gives the boxes around a
    /// leaf at both ends of the interval.
    fn over(nodes: Vec<Node8>, leaf_boxes: impl Fn(usize) -> [Bounds3; 2]) -> Vec<Self>;
}

impl WalkNode for Node8 {
    type Still<'a> = &'a Self;

    #[inline(always)]
    fn at(&self, _fraction: f32) -> &Self {
        self
    }

    fn over(nodes: Vec<Self>, _leaf_boxes: impl Fn(usize) -> [Bounds3; 2]) -> Vec<Self> {
        nodes
    }
}

/// Four pairs of triangles that share an edge. Corners a to d of a pair make the triangles (a, b, c)
/// and (a, c, d); the first of a pair has the lane of the pair, the second that lane plus four.
/// Corners that a lane does not have are NaN, which no test accepts.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct PairLeaf {
    /// Positions by axis, corner, lane of the pair: each row of four is followed by that of the
    /// next corner, so that one load of eight gives a corner of all eight triangles.
    pub(crate) corners: [[[f32; 4]; 4]; 3],
    /// Triangle within its geometry, by lane.
    pub(crate) triangle: [u32; 8],
    /// Placement, for triangles baked into engine space; otherwise zero. By lane of the pair.
    pub(crate) instance: [u32; 4],
    /// For bounds on the rounding errors of a kernel: `[1]` is the length L of the longest edge;
    /// edge functions are off by less than `[0]` times the distance of the first corner plus 3 L,
    /// distances times their sum by less than 6 L times that.
    pub(crate) error: [f32; 2],
    /// The order of a triangle's corners, by lane: an index into [`CORNER_ORDERS`].
    pub(crate) order: [u8; 8],
}

impl PairLeaf {
    pub(crate) const NONE: Self = Self {
        corners: [[[f32::NAN; 4]; 4]; 3],
        triangle: [u32::MAX; 8],
        instance: [0; 4],
        error: [0.0; 2],
        order: [0; 8],
    };

    /// The leaf between this one and `last`, which holds the same triangles.
    #[inline(always)]
    pub(crate) fn between(&self, last: &Self, fraction: f32) -> Self {
        let mut leaf = *self;
        for axis in 0..3 {
            for corner in 0..4 {
                for lane in 0..4 {
                    let first = self.corners[axis][corner][lane];
                    leaf.corners[axis][corner][lane] =
                        lerp(first, last.corners[axis][corner][lane], fraction);
                }
            }
        }
        leaf
    }

    /// The lanes with a triangle.
    pub(crate) fn used_lanes(&self) -> impl Iterator<Item = usize> {
        (0..8).filter(|&lane| self.triangle[lane] != u32::MAX)
    }

    /// A lane's triangle as the tests of single triangles read it.
    #[inline(always)]
    pub(crate) fn lane(&self, lane: usize) -> LeafTriangle<'_> {
        LeafTriangle {
            corners: &self.corners,
            pair: lane & 3,
            rows: self.corner_rows(lane),
        }
    }

    /// The rows of a triangle's corners, in its own order.
    #[inline(always)]
    pub(crate) fn corner_rows(&self, lane: usize) -> [u8; 3] {
        CORNER_ORDERS[(self.order[lane & 7] & 7) as usize]
    }

    /// The triangle of a lane, for the tree of `id_base`.
    #[inline(always)]
    pub(crate) fn id(&self, lane: usize, id_base: u32) -> PrimitiveId {
        PrimitiveId {
            instance: id_base + self.instance[lane & 3],
            primitive: self.triangle[lane & 7],
        }
    }

    /// The hit of a lane, for the tree of `id_base`.
    #[inline(always)]
    pub(crate) fn hit(&self, lane: usize, [t, u, v]: [f32; 3], id_base: u32) -> Hit {
        Hit {
            t,
            u,
            v,
            primitive: self.triangle[lane],
            instance: id_base + self.instance[lane & 3],
        }
    }
}

/// Rows of a triangle's corners in its own order: three turns of (a, b, c), then of (a, c, d).
/// Padded to eight so that no index needs a check.
const CORNER_ORDERS: [[u8; 3]; 8] = [
    [0, 1, 2],
    [1, 2, 0],
    [2, 0, 1],
    [0, 2, 3],
    [2, 3, 0],
    [3, 0, 2],
    [0; 3],
    [0; 3],
];

/// One triangle of a leaf.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LeafTriangle<'a> {
    corners: &'a [[[f32; 4]; 4]; 3],
    pair: usize,
    rows: [u8; 3],
}

impl LeafTriangle<'_> {
    /// A coordinate of a corner, in the triangle's own order.
    #[inline(always)]
    pub(crate) fn coordinate(&self, corner: usize, axis: usize) -> f32 {
        self.corners[axis][(self.rows[corner] & 3) as usize][self.pair & 3]
    }

    /// The corners in the triangle's own order.
    pub(crate) fn corners(&self) -> [[f32; 3]; 3] {
        [0, 1, 2].map(|corner| [0, 1, 2].map(|axis| self.coordinate(corner, axis)))
    }
}

/// A bounding volume hierarchy; node 0 is the root and always exists.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    pub(crate) nodes: Vec<Node8>,
    pub(crate) leaves: Vec<PairLeaf>,
    /// Triangles that leaves hold at least once.
    pub(crate) n_triangles: usize,
}

impl Tree {
    pub(crate) fn n_bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.leaves.as_slice())
    }
}

const _: () = assert!(size_of::<Node8>() == 256 && size_of::<PairLeaf>() == 256);
