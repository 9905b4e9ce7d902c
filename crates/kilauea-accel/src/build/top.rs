use super::soup::MAX_COORDINATE;
use super::{WideOptions, balanced, binary, bounded_widen};
use crate::geometry::Quality;
use crate::node::{LEAF, Node8};
use kilauea_math::{Bounds3, DAffine3, DVec3};
use obvhs::aabb::Aabb;

/// Builds the tree over instances or buckets; a leaf link is the index of a box.
/// Traversal needs at most `stack` entries.
pub(crate) fn build_top(boxes: &[Aabb], quality: Quality, stack: usize) -> Vec<Node8> {
    let options = WideOptions {
        max_leaf_size: 1,
        leaf_cost: 4.0,
        primitive_cost: 0.0,
    };
    let bvh = binary::over_boxes(boxes, quality);
    let (mut nodes, leaves) = bounded_widen(bvh, options, stack, || balanced::over_boxes(boxes));
    for link in nodes.iter_mut().flat_map(|node| &mut node.child) {
        if *link & LEAF != 0
            && let Some(leaf) = leaves.get((*link & !LEAF) as usize)
        {
            *link = leaf[0] | LEAF;
        }
    }
    nodes
}

/// A box in engine space around placed boxes at all times; `None` if it is out of range.
///
/// Where matrices and boxes are interpolated, points go to means of where the keys take the boxes.
pub(crate) fn instance_bounds(boxes: &[Bounds3], keys: &[DAffine3]) -> Option<Aabb> {
    let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for Bounds3 {
        min: low,
        max: high,
    } in boxes
    {
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { low } else { high }[axis];
            let p = DVec3::from_array([0, 1, 2].map(|axis| f64::from(pick(axis))));
            for world_from_geometry in keys {
                let p_world = world_from_geometry.transform_point3(p);
                min = min.min(p_world);
                max = max.max(p_world);
            }
        }
    }
    // Boxes are a little larger than what they hold.
    let most = 1.001 * f64::from(MAX_COORDINATE);
    let in_range = min.cmple(max).all() && min.abs().max(max.abs()).max_element() <= most;
    in_range.then(|| Aabb::new(min.as_vec3a(), max.as_vec3a()))
}
