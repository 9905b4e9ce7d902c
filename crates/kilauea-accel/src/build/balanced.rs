use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;

/// A tree of least depth: every node halves its boxes at the median of the widest axis.
pub(crate) fn over_boxes(boxes: &[Aabb]) -> Bvh2 {
    let mut bvh = Bvh2 {
        primitive_indices: (0..boxes.len() as u32).collect(),
        ..Bvh2::default()
    };
    if boxes.is_empty() {
        return bvh;
    }
    bvh.nodes.push(Bvh2Node::default());
    let mut open = vec![(0, 0, boxes.len())];
    while let Some((node, begin, end)) = open.pop() {
        let indices = &mut bvh.primitive_indices[begin..end];
        let bounds = indices
            .iter()
            .map(|&i| boxes[i as usize])
            .reduce(|a, b| a.union(&b))
            .unwrap_or(Aabb::INVALID);
        if end - begin == 1 {
            bvh.nodes[node] = Bvh2Node::new(bounds, 1, begin as u32);
            continue;
        }
        let axis = bounds.largest_axis();
        let center = |i: &u32| boxes[*i as usize].center_axis(axis);
        let half = indices.len() / 2;
        indices.select_nth_unstable_by(half, |a, b| center(a).total_cmp(&center(b)));

        let first_child = bvh.nodes.len();
        bvh.nodes[node] = Bvh2Node::new(bounds, 0, first_child as u32);
        bvh.nodes.extend([Bvh2Node::default(); 2]);
        open.push((first_child, begin, begin + half));
        open.push((first_child + 1, begin + half, end));
    }
    bvh
}
