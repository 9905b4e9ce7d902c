use super::collapse::LeafOptions;
use super::reference::references;
use super::soup::MAX_COORDINATE;
use super::wide::WideTree;
use crate::node::{LEAF, Node8};
use kilauea_math::{Bounds3, DAffine3, DVec3};
use obvhs::aabb::Aabb;

/// To go through an instance costs much more than a node.
const INSTANCES: LeafOptions = LeafOptions {
    max_size: 1,
    cost: 4.0,
    primitive_cost: 0.0,
};

/// Builds the tree over instances; a leaf link is the index of a box.
pub(crate) fn build_top(boxes: Vec<Aabb>) -> Vec<Node8> {
    let WideTree { mut nodes, leaves } = WideTree::over(references(boxes), INSTANCES);
    for link in nodes.iter_mut().flat_map(|node| &mut node.child) {
        if *link & LEAF != 0
            && let Some(leaf) = leaves.get((*link & !LEAF) as usize)
            && let Some(instance) = leaf.items().next()
        {
            *link = instance as u32 | LEAF;
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
