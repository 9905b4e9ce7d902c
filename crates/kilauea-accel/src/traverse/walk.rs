//! Orders of visit through one tree.

use super::kernel::{Kernel, Lanes};
use super::stack::{Entry, Links, Stack, Storage, entry, link};
use crate::node::{LEAF, Node8, WalkNode};

/// What a walk does at the leaves.
pub(crate) trait Visitor {
    /// The walk ignores boxes entered beyond this.
    fn limit(&self) -> f32;
    /// Called with a leaf; true ends the walk.
    fn visit(&mut self, leaf: u32) -> bool;
    /// Where the leaf is stored.
    fn address(&self, leaf: u32) -> *const u8;
}

/// Walks in the order that serves the question: whether there is `ANY` hit, which it answers, or
/// which is nearest.
#[inline(always)]
pub(crate) fn walk<K: Kernel, N: WalkNode, const ANY: bool>(
    kernel: K,
    nodes: (&[N], f32),
    ray: &K::NodeRay,
    visitor: &mut impl Visitor,
) -> bool {
    if ANY {
        return any_order(kernel, nodes, ray, visitor);
    }
    near_first(kernel, nodes, ray, visitor);
    false
}

/// Visits the leaves that the ray passes, near ones first, until one ends the walk. The nodes are
/// read at `fraction` of the interval between two motion keys, if they move.
#[inline(always)]
fn near_first<K: Kernel, N: WalkNode>(
    kernel: K,
    (nodes, fraction): (&[N], f32),
    ray: &K::NodeRay,
    visitor: &mut impl Visitor,
) {
    let mut storage = K::Storage::new();
    let mut stack = Stack::new(&mut storage);
    let mut current = 0;
    loop {
        while current & LEAF == 0 {
            let node = kernel.item(nodes, current).at(fraction);
            let (mask, entries) = kernel.slabs(ray, visitor.limit(), &node);
            let children = Children {
                kernel,
                visitor,
                nodes,
                node: &node,
                entries: &entries,
                mask,
            };
            let Some(nearest) = descend(children, &mut stack) else {
                let Some(next) = stack.pop_within(visitor.limit()) else {
                    return;
                };
                current = link(next);
                continue;
            };
            current = link(nearest);
        }
        if visitor.visit(current & !LEAF) {
            return;
        }
        let Some(next) = stack.pop_within(visitor.limit()) else {
            return;
        };
        current = link(next);
    }
}

/// The children of a node that the ray enters.
struct Children<'a, K, V, N> {
    kernel: K,
    visitor: &'a V,
    nodes: &'a [N],
    node: &'a Node8,
    entries: &'a Lanes,
    mask: u32,
}

impl<K: Kernel, V: Visitor, N: WalkNode> Children<'_, K, V, N> {
    /// The lowest lane. Where rays scatter, guesses would mostly be wrong.
    #[inline(always)]
    fn next_lane(&self) -> usize {
        if K::COHERENT {
            self.kernel.first_lane::<true>(self.mask)
        } else {
            self.kernel.first_lane::<false>(self.mask)
        }
    }

    /// Takes the child of the lowest lane.
    #[inline(always)]
    fn next(&mut self) -> Entry {
        let lane = self.next_lane();
        self.mask &= self.mask.wrapping_sub(1);
        entry(self.node.child[lane], self.entries.0[lane])
    }

    /// Takes the child of the lowest lane and begins to load it.
    #[inline(always)]
    fn fetch(&mut self) -> Entry {
        let child = self.next();
        let address = if link(child) & LEAF == 0 {
            self.nodes
                .as_ptr()
                .wrapping_add(link(child) as usize)
                .cast()
        } else {
            self.visitor.address(link(child) & !LEAF)
        };
        self.kernel.prefetch(address);
        child
    }
}

/// Pushes all children hit but the nearest, far ones first, and gives the nearest.
#[inline(always)]
fn descend<K: Kernel, N: WalkNode>(
    mut children: Children<'_, K, impl Visitor, N>,
    stack: &mut Stack<'_, K::Storage>,
) -> Option<Entry> {
    if children.mask == 0 {
        return None;
    }
    let a = children.next();
    if children.mask == 0 {
        return Some(a);
    }
    let b = children.fetch();
    let (a, b) = in_order(a, b);
    if children.mask == 0 {
        stack.push(b);
        return Some(a);
    }
    let c = children.fetch();
    if children.mask == 0 {
        let (b, c) = in_order(b, c);
        let (a, b) = in_order(a, b);
        stack.push(c);
        stack.push(b);
        return Some(a);
    }
    let d = children.fetch();
    if children.mask == 0 {
        let (c, d) = in_order(c, d);
        let ((a, c), (b, d)) = (in_order(a, c), in_order(b, d));
        let (b, c) = in_order(b, c);
        stack.push(d);
        stack.push(c);
        stack.push(b);
        return Some(a);
    }
    stack.push(a);
    stack.push(b);
    stack.push(c);
    stack.push(d);
    let mut n = 4;
    while children.mask != 0 {
        stack.push(children.fetch());
        n += 1;
    }
    stack.sort_top(n);
    stack.pop()
}

#[inline(always)]
fn in_order(a: Entry, b: Entry) -> (Entry, Entry) {
    (a.min(b), a.max(b))
}

/// Visits the leaves that the ray passes, those below the last lanes first, until one ends the walk.
#[inline(always)]
fn any_order<K: Kernel, N: WalkNode>(
    kernel: K,
    (nodes, fraction): (&[N], f32),
    ray: &K::NodeRay,
    visitor: &mut impl Visitor,
) -> bool {
    let mut open = K::Links::new();
    let mut n_open = 0;
    let mut current = 0;
    loop {
        if current & LEAF == 0 {
            let node = kernel.item(nodes, current).at(fraction);
            let (mask, _) = kernel.slabs(ray, visitor.limit(), &node);
            if mask != 0 {
                // The next child can be guessed; how many more there are, no branch asks.
                let lane = kernel.last_lane(mask);
                current = node.child[lane];
                n_open = open.push_lanes(n_open, &node.child, mask ^ 1 << lane);
                continue;
            }
        } else if visitor.visit(current & !LEAF) {
            return true;
        }
        if n_open == 0 {
            return false;
        }
        n_open -= 1;
        current = open.read(n_open);
    }
}
