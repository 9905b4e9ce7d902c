//! Orders of visit through one tree.

use super::kernel::{Entries, Kernel};
use super::stack::{Entry, Stack, distance, entry, link};
use crate::node::{LEAF, Node8};

/// What a walk does at the leaves.
pub(crate) trait Visitor {
    /// The walk ignores boxes entered beyond this.
    fn limit(&self) -> f32;
    /// Called with a leaf and where the ray enters it; true ends the walk.
    fn visit(&mut self, leaf: u32, t_entry: f32) -> bool;
    /// Called when a leaf will be visited soon.
    fn prefetch(&self, leaf: u32);
}

/// Visits the leaves that the ray passes, near ones first.
#[inline(always)]
pub(crate) fn near_first<K: Kernel>(
    kernel: K,
    nodes: &[Node8],
    ray: &K::NodeRay,
    visitor: &mut impl Visitor,
) {
    let mut stack = K::Stack::new();
    let mut current = 0;
    let mut t_entry = 0.0;
    loop {
        while current & LEAF == 0 {
            let node = kernel.item(nodes, current);
            let (mask, entries) = kernel.slabs(ray, visitor.limit(), node);
            let Some(nearest) = descend(kernel, nodes, visitor, node, mask, &entries, &mut stack)
            else {
                let Some(next) = pop_within(&mut stack, visitor.limit()) else {
                    return;
                };
                (current, t_entry) = (link(next), distance(next));
                continue;
            };
            (current, t_entry) = (link(nearest), distance(nearest));
        }
        if visitor.visit(current & !LEAF, t_entry) {
            return;
        }
        let Some(next) = pop_within(&mut stack, visitor.limit()) else {
            return;
        };
        (current, t_entry) = (link(next), distance(next));
    }
}

/// Pushes all children hit but the nearest, far ones first, and gives the nearest.
#[inline(always)]
fn descend<K: Kernel>(
    kernel: K,
    nodes: &[Node8],
    visitor: &impl Visitor,
    node: &Node8,
    mask: u32,
    entries: &Entries,
    stack: &mut K::Stack,
) -> Option<Entry> {
    let prefetch = |link: u32| {
        if link & LEAF == 0 {
            kernel.prefetch(nodes, link);
        } else {
            visitor.prefetch(link & !LEAF);
        }
    };
    let mut rest = mask;
    let mut take = || {
        let lane = (rest.trailing_zeros() & 7) as usize;
        rest &= rest.wrapping_sub(1);
        prefetch(node.child[lane]);
        entry(node.child[lane], entries.0[lane])
    };
    match mask.count_ones() {
        0 => None,
        1 => {
            let lane = (mask.trailing_zeros() & 7) as usize;
            Some(entry(node.child[lane], entries.0[lane]))
        }
        2 => {
            let (a, b) = in_order(take(), take());
            stack.push(b);
            Some(a)
        }
        3 => {
            let (a, b, c) = (take(), take(), take());
            let (a, b) = in_order(a, b);
            let (b, c) = in_order(b, c);
            let (a, b) = in_order(a, b);
            stack.push(c);
            stack.push(b);
            Some(a)
        }
        4 => {
            let (a, b, c, d) = (take(), take(), take(), take());
            let ((a, b), (c, d)) = (in_order(a, b), in_order(c, d));
            let ((a, c), (b, d)) = (in_order(a, c), in_order(b, d));
            let (b, c) = in_order(b, c);
            stack.push(d);
            stack.push(c);
            stack.push(b);
            Some(a)
        }
        n => {
            for _ in 0..n {
                stack.push(take());
            }
            far_to_near(stack.top(n as usize));
            stack.pop()
        }
    }
}

#[inline(always)]
fn in_order(a: Entry, b: Entry) -> (Entry, Entry) {
    (a.min(b), a.max(b))
}

/// Insertion sort: a handful of entries.
#[inline(always)]
fn far_to_near(entries: &mut [Entry]) {
    for sorted in 1..entries.len() {
        let new = entries[sorted];
        let mut i = sorted;
        while i > 0 && entries[i - 1] < new {
            entries[i] = entries[i - 1];
            i -= 1;
        }
        entries[i] = new;
    }
}

#[inline(always)]
fn pop_within(stack: &mut impl Stack, limit: f32) -> Option<Entry> {
    loop {
        let next = stack.pop()?;
        if distance(next) <= limit {
            return Some(next);
        }
    }
}

/// Visits the leaves that the ray passes in no order, until one ends the walk.
#[inline(always)]
pub(crate) fn any_order<K: Kernel>(
    kernel: K,
    nodes: &[Node8],
    ray: &K::NodeRay,
    visitor: &mut impl Visitor,
) -> bool {
    let mut stack = K::Stack::new();
    let mut current = entry(0, 0.0);
    loop {
        while link(current) & LEAF == 0 {
            let node = kernel.item(nodes, link(current));
            let (mut mask, entries) = kernel.slabs(ray, visitor.limit(), node);
            while mask != 0 {
                let lane = (mask.trailing_zeros() & 7) as usize;
                stack.push(entry(node.child[lane], entries.0[lane]));
                mask &= mask - 1;
            }
            let Some(next) = stack.pop() else {
                return false;
            };
            current = next;
        }
        if visitor.visit(link(current) & !LEAF, distance(current)) {
            return true;
        }
        let Some(next) = stack.pop() else {
            return false;
        };
        current = next;
    }
}
