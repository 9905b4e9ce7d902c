use super::{Block, BlockRay, Limit};
use crate::motion::MotionNode8;
use crate::node::Node8;
use crate::primitive::{Piece, RayFrame, Segment};
use crate::traverse::Kernel;
use kilauea_math::Bounds3;

/// The segments that the blocks of a tree refer to.
#[derive(Clone, Debug, Default)]
pub(crate) struct CurveStore {
    pub(crate) segments: Vec<StoredSegment>,
    /// The same segments at the end of the interval; empty where they stand still.
    pub(crate) later: Vec<Segment>,
    /// Of the control points of oriented ribbons.
    pub(crate) normals: Vec<[[f32; 3]; 4]>,
}

/// A segment with what belongs to it.
#[derive(Clone, Debug)]
pub(crate) struct StoredSegment {
    pub(crate) segment: Segment,
    /// Segment within its geometry.
    pub(crate) primitive: u32,
    /// Index into [`CurveStore::normals`], if it is oriented.
    pub(crate) normals: u32,
}

impl CurveStore {
    /// Boxes around a piece of a segment at both ends of the interval.
    pub(crate) fn bounds(&self, segment: u32, piece: Piece) -> [Bounds3; 2] {
        let first = &self.segments[segment as usize].segment;
        match self.later.get(segment as usize) {
            None => [first.bounds(piece); 2],
            Some(last) => {
                // Interpolated control points are rounded, and may lie further out than the piece.
                let margin = 8.0 * f32::EPSILON * first.size().max(last.size());
                [first, last].map(|segment| {
                    let bounds = segment.bounds(piece);
                    Bounds3 {
                        min: bounds.min - margin,
                        max: bounds.max + margin,
                    }
                })
            }
        }
    }

    pub(crate) fn n_bytes(&self) -> usize {
        size_of_val(self.segments.as_slice())
            + size_of_val(self.later.as_slice())
            + size_of_val(self.normals.as_slice())
    }
}

/// Up to four pieces of segments.
#[derive(Clone, Debug)]
pub(crate) struct CurveBlock {
    /// `u32::MAX` in unused lanes, which come last.
    pub(crate) segment: [u32; 4],
    pub(crate) piece: [Piece; 4],
}

impl CurveBlock {
    /// At most four pieces.
    pub(crate) fn new(pieces: impl IntoIterator<Item = (u32, Piece)>) -> Self {
        let mut block = Self {
            segment: [u32::MAX; 4],
            piece: [Piece::WHOLE; 4],
        };
        for (lane, (segment, piece)) in pieces.into_iter().enumerate() {
            block.segment[lane] = segment;
            block.piece[lane] = piece;
        }
        block
    }

    fn pieces(&self) -> impl Iterator<Item = (u32, Piece)> {
        let all = self.segment.into_iter().zip(self.piece);
        all.take_while(|&(segment, _)| segment != u32::MAX)
    }

    #[inline(always)]
    fn offer_hits(
        &self,
        store: &CurveStore,
        ray: &RayFrame,
        limit: f32,
        segment_at: impl Fn(u32) -> Segment,
        mut offer: impl FnMut(u32, [f32; 3]) -> bool,
    ) {
        for (index, piece) in self.pieces() {
            let stored = &store.segments[index as usize];
            let normals = store.normals.get(stored.normals as usize);
            let segment = segment_at(index);
            if let Some(place) = segment.intersect(normals, piece, ray, limit)
                && offer(stored.primitive, place.rounded())
            {
                return;
            }
        }
    }

    fn primitives(&self, store: &CurveStore) -> Vec<(u32, [Bounds3; 2])> {
        self.pieces()
            .map(|(index, piece)| {
                let primitive = store.segments[index as usize].primitive;
                (primitive, store.bounds(index, piece))
            })
            .collect()
    }
}

impl Block for CurveBlock {
    type Node = Node8;
    type Store = CurveStore;
    type Ray<K: Kernel> = RayFrame;

    #[inline(always)]
    fn ray<K: Kernel>(_: K, ray: &BlockRay<'_>) -> RayFrame {
        ray.frame()
    }

    #[inline(always)]
    fn intersect<K: Kernel>(
        &self,
        store: &CurveStore,
        _: K,
        ray: &RayFrame,
        limit: Limit,
        offer: impl FnMut(u32, [f32; 3]) -> bool,
    ) {
        let segment_at = |index: u32| store.segments[index as usize].segment;
        self.offer_hits(store, ray, limit.t, segment_at, offer);
    }

    fn primitives(&self, store: &CurveStore) -> Vec<(u32, [Bounds3; 2])> {
        self.primitives(store)
    }
}

/// Up to four pieces of segments whose control points move.
#[derive(Clone, Debug)]
pub(crate) struct MovingCurveBlock(pub(crate) CurveBlock);

impl Block for MovingCurveBlock {
    type Node = MotionNode8;
    type Store = CurveStore;
    type Ray<K: Kernel> = (RayFrame, f32);

    #[inline(always)]
    fn ray<K: Kernel>(_: K, ray: &BlockRay<'_>) -> (RayFrame, f32) {
        (ray.frame(), ray.fraction)
    }

    #[inline(always)]
    fn intersect<K: Kernel>(
        &self,
        store: &CurveStore,
        _: K,
        (ray, fraction): &(RayFrame, f32),
        limit: Limit,
        offer: impl FnMut(u32, [f32; 3]) -> bool,
    ) {
        let segment_at = |index: u32| {
            let first = &store.segments[index as usize].segment;
            first.at_time(&store.later[index as usize], *fraction)
        };
        self.0.offer_hits(store, ray, limit.t, segment_at, offer);
    }

    fn primitives(&self, store: &CurveStore) -> Vec<(u32, [Bounds3; 2])> {
        self.0.primitives(store)
    }
}
