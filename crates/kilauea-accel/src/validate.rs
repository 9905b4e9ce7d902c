use crate::accel::Accel;
use crate::block::{Block, BlockTree};
use crate::forest::Kind;
use crate::motion::lerp;
use crate::node::{LEAF, Node8, PairLeaf, STACK_CAPACITY, Tree, WalkNode};
use crate::traverse::Part;
use std::collections::BTreeSet;

impl Accel {
    /// Checks what the walks rely on: links in range, every node and leaf reached once, boxes
    /// inside their parents' and around (parts of) their primitives, none of those lost, and a stack
    /// that suffices. For tests; costs as much as a build.
    ///
    /// # Errors
    /// Says which node of which tree is wrong and how.
    pub fn validate(&self) -> Result<(), String> {
        let forest = &self.forest;
        for (index, tree) in forest.triangles.iter().enumerate() {
            check_tree(tree).map_err(|error| format!("triangle tree {index}: {error}"))?;
        }
        check_block_trees(&forest.moving_triangles).map_err(|e| format!("moving {e}"))?;
        check_block_trees(&forest.spheres).map_err(|e| format!("sphere {e}"))?;
        check_block_trees(&forest.moving_spheres).map_err(|e| format!("moving sphere {e}"))?;
        check_block_trees(&forest.curves).map_err(|e| format!("curve {e}"))?;
        check_block_trees(&forest.moving_curves).map_err(|e| format!("moving curve {e}"))?;
        let Some(top) = &self.top else {
            return Ok(());
        };
        let n_intervals = |part: &Part| part.n_keys.max(2) as usize - 1;
        for (index, instance) in top.instances.iter().enumerate() {
            let part = top.parts.as_ref().map(|parts| &parts[index]);
            let n_trees = match part.map_or(Kind::Triangles, |part| part.kind) {
                Kind::Triangles => forest.triangles.len(),
                Kind::MovingTriangles => forest.moving_triangles.len(),
                Kind::Spheres => forest.spheres.len(),
                Kind::MovingSpheres => forest.moving_spheres.len(),
                Kind::Curves => forest.curves.len(),
                Kind::MovingCurves => forest.moving_curves.len(),
            };
            if instance.tree as usize + part.map_or(1, n_intervals) > n_trees {
                return Err(format!("top: no tree {}", instance.tree));
            }
        }
        check_nodes(&top.nodes, top.instances.len(), |_, _, _| Ok(()))
            .map_err(|error| format!("top: {error}"))
    }
}

/// Checks the trees at the beginning, within and at the end of their intervals.
fn check_block_trees<B: Block>(trees: &[BlockTree<B>]) -> Result<(), String> {
    for (index, tree) in trees.iter().enumerate() {
        for fraction in [0.0, 0.3, 1.0] {
            check_block_tree(tree, fraction).map_err(|error| format!("tree {index}: {error}"))?;
        }
    }
    Ok(())
}

fn check_block_tree<B: Block>(tree: &BlockTree<B>, fraction: f32) -> Result<(), String> {
    let nodes: Vec<Node8> = tree.nodes.iter().map(|node| *node.at(fraction)).collect();
    let mut seen = BTreeSet::new();
    check_nodes(&nodes, tree.leaves.len(), |leaf, low, high| {
        for (primitive, [first, last]) in tree.leaves[leaf].primitives(&tree.store) {
            seen.insert(primitive);
            let is_inside = (0..3).all(|axis| {
                low[axis] <= lerp(first.min[axis], last.min[axis], fraction)
                    && high[axis] >= lerp(first.max[axis], last.max[axis], fraction)
            });
            if !is_inside {
                return Err(format!("primitive {primitive} leaves its box"));
            }
        }
        Ok(())
    })?;
    if seen.len() == tree.n_primitives {
        Ok(())
    } else {
        Err(format!(
            "{} of {} primitives",
            seen.len(),
            tree.n_primitives
        ))
    }
}

fn check_tree(tree: &Tree) -> Result<(), String> {
    let mut seen = BTreeSet::new();
    check_nodes(&tree.nodes, tree.leaves.len(), |leaf, low, high| {
        let leaf = &tree.leaves[leaf];
        for lane in leaf.used_lanes() {
            seen.insert((leaf.instance[lane & 3], leaf.triangle[lane]));
            // A part of a pair brings all of it.
            if !overlaps(leaf, lane, low, high) && !overlaps(leaf, lane ^ 4, low, high) {
                return Err(format!("triangle {} outside its leaf", leaf.triangle[lane]));
            }
        }
        Ok(())
    })?;
    if seen.len() == tree.n_triangles {
        Ok(())
    } else {
        Err(format!("{} of {} triangles", seen.len(), tree.n_triangles))
    }
}

/// Walks all nodes; `check_leaf` gets a leaf and its box.
fn check_nodes(
    nodes: &[Node8],
    n_leaves: usize,
    mut check_leaf: impl FnMut(usize, [f32; 3], [f32; 3]) -> Result<(), String>,
) -> Result<(), String> {
    let mut node_visits = vec![0; nodes.len()];
    let mut leaf_visits = vec![0; n_leaves];
    let everywhere = ([f32::NEG_INFINITY; 3], [f32::INFINITY; 3]);
    let mut open = vec![(0_usize, everywhere, 0)];
    while let Some((index, (outer_low, outer_high), stack_below)) = open.pop() {
        let node = &nodes[index];
        node_visits[index] += 1;
        if node_visits[index] > 1 {
            return Err(format!("node {index} has two parents"));
        }
        let n_children = node.used_lanes().count();
        if stack_below + n_children > STACK_CAPACITY {
            return Err(format!("the stack is too small at node {index}"));
        }
        for lane in node.used_lanes() {
            let (low, high) = node.lane_bounds(lane);
            let is_inside = (0..3).all(|axis| {
                outer_low[axis] <= low[axis]
                    && low[axis] < high[axis]
                    && high[axis] <= outer_high[axis]
            });
            if !is_inside {
                return Err(format!("node {index}: lane {lane} leaves the parent's box"));
            }
            let link = (node.child[lane] & !LEAF) as usize;
            if node.child[lane] & LEAF == 0 {
                if link >= nodes.len() {
                    return Err(format!("node {index}: no node {link}"));
                }
                open.push((link, (low, high), stack_below + n_children - 1));
                continue;
            }
            *leaf_visits
                .get_mut(link)
                .ok_or_else(|| format!("node {index}: no leaf {link}"))? += 1;
            check_leaf(link, low, high).map_err(|error| format!("node {index}: {error}"))?;
        }
    }
    let all_once = node_visits.iter().chain(&leaf_visits).all(|&n| n == 1);
    if all_once {
        Ok(())
    } else {
        Err("a node or leaf is unreachable or shared".to_owned())
    }
}

/// Whether the bounds of a triangle touch the box.
fn overlaps(leaf: &PairLeaf, lane: usize, low: [f32; 3], high: [f32; 3]) -> bool {
    let corners = leaf.lane(lane).corners();
    (0..3).all(|axis| {
        let along = corners.map(|corner| corner[axis]);
        let least = along.into_iter().fold(f32::INFINITY, f32::min);
        let most = along.into_iter().fold(f32::NEG_INFINITY, f32::max);
        least <= high[axis] && most >= low[axis]
    })
}
