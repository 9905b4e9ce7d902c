//! Binary trees over boxes, at a quality.

use super::binned;
use crate::geometry::Quality;
use obvhs::Boundable;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;

/// Share of the nodes that the better build tries to put elsewhere.
const REINSERTION: f32 = 0.05;

/// One box to a leaf.
pub(crate) fn over_boxes<T: Boundable>(boxes: &[T], quality: Quality) -> Bvh2 {
    let mut bvh = binned::over_boxes(boxes.iter().map(Boundable::aabb));
    if quality == Quality::Final && boxes.len() > 2 {
        ReinsertionOptimizer::default().run(&mut bvh, REINSERTION, None);
    }
    bvh
}
