//! Eight-wide trees from binary ones, at the least expected cost.

use crate::node::{LEAF, Node8};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;

/// What a leaf may hold and cost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WideOptions {
    /// Most primitives to a leaf.
    pub(crate) max_leaf_size: u32,
    /// Cost of a leaf block, however full, in node visits.
    pub(crate) leaf_cost: f32,
    /// Further cost of each primitive in a leaf.
    pub(crate) primitive_cost: f32,
}

/// An eight-wide tree whose leaves are lists of primitives.
#[derive(Clone, Debug)]
pub(crate) struct WideTree {
    pub(crate) nodes: Vec<Node8>,
    pub(crate) leaves: Vec<Vec<u32>>,
    /// Most entries a traversal can have on its stack.
    pub(crate) stack_need: usize,
}

/// The cheapest ways to stand for a binary subtree (Ylitie et al. 2017, section 4.1).
#[derive(Clone, Copy, Debug, Default)]
struct Choice {
    /// Cost with at most `i + 1` roots.
    cost: [f32; 7],
    /// Roots that the left child gets of `i + 1`; zero where one root fewer is as good.
    /// The last entry is for the eight children of a wide node.
    left: [u8; 8],
    n_primitives: u32,
    is_leaf: bool,
}

/// Collapses `bvh` into eight-wide nodes.
pub(crate) fn widen(bvh: &Bvh2, options: WideOptions) -> WideTree {
    let mut wide = WideTree {
        nodes: vec![Node8::NONE],
        leaves: Vec::new(),
        stack_need: 0,
    };
    let Some(root) = bvh.nodes.first() else {
        return wide;
    };
    let choices = choose(bvh, options);
    let scale = root
        .aabb()
        .min
        .abs()
        .max(root.aabb().max.abs())
        .max_element();

    let mut open = vec![(0, 0, 0)];
    while let Some((binary, node, stack_below)) = open.pop() {
        let mut children = Vec::with_capacity(8);
        if choices[binary].is_leaf {
            children.push(binary);
        } else {
            split_roots(bvh, &choices, binary, 8, &mut children);
            order_for_any_hit(bvh, &choices, &mut children);
        }
        wide.stack_need = wide.stack_need.max(stack_below + children.len());

        for (lane, &child) in children.iter().enumerate() {
            set_lane_bounds(&mut wide.nodes[node], lane, bvh.nodes[child].aabb(), scale);
            wide.nodes[node].child[lane] = if choices[child].is_leaf {
                wide.leaves.push(primitives_below(bvh, child));
                (wide.leaves.len() - 1) as u32 | LEAF
            } else {
                wide.nodes.push(Node8::NONE);
                let index = wide.nodes.len() - 1;
                open.push((child, index, stack_below + children.len() - 1));
                index as u32
            };
        }
    }
    wide
}

/// Fills the table of choices from the leaves up.
fn choose(bvh: &Bvh2, options: WideOptions) -> Vec<Choice> {
    let mut choices = vec![Choice::default(); bvh.nodes.len()];
    for index in parents_first(bvh).into_iter().rev() {
        let node = &bvh.nodes[index];
        let area = node.aabb().half_area();
        let leaf_cost = |n: u32| area * (options.leaf_cost + n as f32 * options.primitive_cost);
        if node.is_leaf() {
            let as_leaf = leaf_cost(node.prim_count);
            choices[index] = Choice {
                cost: [as_leaf; 7],
                left: [0; 8],
                n_primitives: node.prim_count,
                is_leaf: true,
            };
            continue;
        }
        let (l, r) = (
            choices[node.first_index as usize],
            choices[node.first_index as usize + 1],
        );
        let best_split = |n_roots: usize| {
            (1..n_roots)
                .filter(|&k| k <= 7 && n_roots - k <= 7)
                .map(|k| (l.cost[k - 1] + r.cost[n_roots - k - 1], k as u8))
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .unwrap_or((f32::INFINITY, 1))
        };
        let mut choice = Choice {
            n_primitives: l.n_primitives + r.n_primitives,
            ..Choice::default()
        };
        let as_leaf = leaf_cost(choice.n_primitives);
        let (below, left) = best_split(8);
        choice.left[7] = left;
        choice.is_leaf = choice.n_primitives <= options.max_leaf_size && as_leaf <= area + below;
        choice.cost[0] = if choice.is_leaf {
            as_leaf
        } else {
            area + below
        };
        for i in 1..7 {
            let (cost, left) = best_split(i + 1);
            (choice.cost[i], choice.left[i]) = if cost < choice.cost[i - 1] {
                (cost, left)
            } else {
                (choice.cost[i - 1], 0)
            };
        }
        choices[index] = choice;
    }
    choices
}

/// Every node after its parent.
fn parents_first(bvh: &Bvh2) -> Vec<usize> {
    let mut order = Vec::with_capacity(bvh.nodes.len());
    let mut open = vec![0];
    while let Some(index) = open.pop() {
        order.push(index);
        let node = &bvh.nodes[index];
        if !node.is_leaf() {
            open.extend([node.first_index as usize + 1, node.first_index as usize]);
        }
    }
    order
}

/// Appends the roots that stand for the two children of `binary`.
fn split_roots(
    bvh: &Bvh2,
    choices: &[Choice],
    binary: usize,
    n_roots: usize,
    out: &mut Vec<usize>,
) {
    let n_left = choices[binary].left[n_roots - 1] as usize;
    let first_child = bvh.nodes[binary].first_index as usize;
    for (child, mut n) in [(first_child, n_left), (first_child + 1, n_roots - n_left)] {
        while n > 1 && choices[child].left[n - 1] == 0 {
            n -= 1;
        }
        if n == 1 {
            out.push(child);
        } else {
            split_roots(bvh, choices, child, n, out);
        }
    }
}

/// Puts the children in the order in which a walk for any hit should try them: leaves first, which
/// can end it at once, then large ones. It takes the first lane first, and then from the last down.
fn order_for_any_hit(bvh: &Bvh2, choices: &[Choice], children: &mut [usize]) {
    let area = |child: usize| bvh.nodes[child].aabb().half_area();
    children.sort_by(|&a, &b| {
        let leaves_first = choices[b].is_leaf.cmp(&choices[a].is_leaf);
        leaves_first.then(area(b).total_cmp(&area(a)))
    });
    children[1..].reverse();
}

/// The primitives of a subtree, in order.
fn primitives_below(bvh: &Bvh2, root: usize) -> Vec<u32> {
    let mut primitives = Vec::new();
    let mut open = vec![root];
    while let Some(index) = open.pop() {
        let node = &bvh.nodes[index];
        let first = node.first_index as usize;
        if node.is_leaf() {
            primitives.extend(&bvh.primitive_indices[first..first + node.prim_count as usize]);
        } else {
            open.extend([first + 1, first]);
        }
    }
    primitives.sort_unstable();
    primitives
}

/// Writes a box a little enlarged, so that a ray within one of its faces is inside: the slab test
/// of a direction component near zero has no other slack.
fn set_lane_bounds(node: &mut Node8, lane: usize, bounds: &Aabb, scale: f32) {
    const ULP: f32 = f32::EPSILON;
    const LEAST: f32 = 1.0 / (1_u64 << 40) as f32;
    for axis in 0..3 {
        let (low, high) = (bounds.min[axis], bounds.max[axis]);
        let least = scale * LEAST;
        node.planes[2 * axis][lane] = low - (low.abs() * ULP + least);
        node.planes[2 * axis + 1][lane] = high + (high.abs() * ULP + least);
    }
}
