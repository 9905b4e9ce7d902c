use super::capsules::Capsules;
use super::{Block, BlockRay, Limit};
use crate::motion::MotionNode8;
use crate::node::Node8;
use crate::primitive::{Capsule, Piece, RayFrame, Segment};
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

    /// Capsules around a piece of a segment at both ends of the interval.
    fn capsules(&self, (segment, piece): (u32, Piece)) -> [Capsule; 2] {
        let first = &self.segments[segment as usize].segment;
        let last = self.later.get(segment as usize).unwrap_or(first);
        [first, last].map(|segment| segment.capsule(piece))
    }

    pub(crate) fn n_bytes(&self) -> usize {
        size_of_val(self.segments.as_slice())
            + size_of_val(self.later.as_slice())
            + size_of_val(self.normals.as_slice())
    }
}

/// Up to four pieces of segments.
#[derive(Clone, Debug)]
struct Pieces {
    /// `u32::MAX` in unused lanes, which come last.
    segment: [u32; 4],
    piece: [Piece; 4],
}

impl Pieces {
    fn new(pieces: &[(u32, Piece)]) -> Self {
        let mut all = Self {
            segment: [u32::MAX; 4],
            piece: [Piece::WHOLE; 4],
        };
        for (lane, &(segment, piece)) in pieces.iter().enumerate() {
            all.segment[lane] = segment;
            all.piece[lane] = piece;
        }
        all
    }

    fn used(&self) -> impl Iterator<Item = (u32, Piece)> {
        let all = self.segment.into_iter().zip(self.piece);
        all.take_while(|&(segment, _)| segment != u32::MAX)
    }

    /// Tests the lanes `open`, whose capsules the ray meets.
    #[inline(always)]
    fn offer_hits(
        &self,
        store: &CurveStore,
        ray: &RayFrame,
        (mut open, limit): (u32, f32),
        segment_at: impl Fn(usize) -> Segment,
        mut offer: impl FnMut(u32, [f32; 3]) -> bool,
    ) {
        while open != 0 {
            let lane = (open.trailing_zeros() & 3) as usize;
            open &= open - 1;
            let index = self.segment[lane] as usize;
            let stored = &store.segments[index];
            let normals = store.normals.get(stored.normals as usize);
            let segment = segment_at(index);
            if let Some(place) = segment.intersect(normals, self.piece[lane], ray, limit)
                && offer(stored.primitive, place.rounded())
            {
                return;
            }
        }
    }

    fn primitives(&self, store: &CurveStore) -> Vec<(u32, [Bounds3; 2])> {
        self.used()
            .map(|(index, piece)| {
                let primitive = store.segments[index as usize].primitive;
                (primitive, store.bounds(index, piece))
            })
            .collect()
    }
}

/// Pieces of segments that stand still.
#[derive(Clone, Debug)]
pub(crate) struct CurveBlock {
    pieces: Pieces,
    capsules: Capsules,
}

impl CurveBlock {
    /// At most four pieces.
    pub(crate) fn new(store: &CurveStore, pieces: &[(u32, Piece)]) -> Self {
        let capsules = pieces.iter().map(|&piece| store.capsules(piece)[0]);
        Self {
            pieces: Pieces::new(pieces),
            capsules: Capsules::new(capsules),
        }
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
        let met = self.capsules.met(ray, depth_limit(ray, limit));
        let segment_at = |index: usize| store.segments[index].segment;
        self.pieces
            .offer_hits(store, ray, (met, limit.t), segment_at, offer);
    }

    fn primitives(&self, store: &CurveStore) -> Vec<(u32, [Bounds3; 2])> {
        self.pieces.primitives(store)
    }
}

/// The depth beyond which hits do not matter; one a little further may round to the limit.
#[inline(always)]
fn depth_limit(ray: &RayFrame, limit: Limit) -> f64 {
    ray.depth(limit.t.next_up())
}

/// Pieces of segments whose control points move.
#[derive(Clone, Debug)]
pub(crate) struct MovingCurveBlock {
    pieces: Pieces,
    /// Around the same pieces as an interval begins and ends.
    ends: [Capsules; 2],
}

impl MovingCurveBlock {
    /// At most four pieces.
    pub(crate) fn new(store: &CurveStore, pieces: &[(u32, Piece)]) -> Self {
        let capsules =
            |end: usize| Capsules::new(pieces.iter().map(|&piece| store.capsules(piece)[end]));
        Self {
            ends: [capsules(0), capsules(1)],
            pieces: Pieces::new(pieces),
        }
    }
}

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
        let capsules = self.ends[0].at_time(&self.ends[1], *fraction);
        let met = capsules.met(ray, depth_limit(ray, limit));
        let segment_at = |index: usize| {
            let first = &store.segments[index].segment;
            first.at_time(&store.later[index], *fraction)
        };
        self.pieces
            .offer_hits(store, ray, (met, limit.t), segment_at, offer);
    }

    fn primitives(&self, store: &CurveStore) -> Vec<(u32, [Bounds3; 2])> {
        self.pieces.primitives(store)
    }
}
