//! Cells: a binary tree over positions and normals.

use kilauea_math::Vec3;
use serde::{Deserialize, Serialize};

/// Divides places, each a position and a normal, into cells.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct CellTree {
    nodes: Vec<Node>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Node {
    /// Component of [`Place`] that is compared; [`CELL`] in a leaf.
    axis: u32,
    /// Places below it belong to the first child, which comes next.
    split: f32,
    /// The second child; in a leaf, the number of the cell.
    link: u32,
}

/// Position, then normal.
pub(crate) type Place = [f32; 6];

const CELL: u32 = 6;
/// Cells whose normals differ by more in one component are divided by normals first: about 60°.
const MAX_NORMAL_EXTENT: f32 = 1.0;
/// Cells of fewer records are not divided by normals.
const MIN_RECORDS: usize = 32;

impl CellTree {
    /// Divides `places` into cells of at most `capacity` each, unless they are all the same. Returns
    /// the numbers of the places of each cell too.
    pub(crate) fn build(places: &[Place], capacity: usize) -> (Self, Vec<Vec<u32>>) {
        let mut growing = Growing {
            tree: Self { nodes: Vec::new() },
            members: Vec::new(),
        };
        let mut numbers: Vec<u32> = (0..places.len() as u32).collect();
        growing.divide(places, &mut numbers, capacity.max(1));
        (growing.tree, growing.members)
    }

    /// The number of the cell of a place.
    #[inline]
    pub(crate) fn cell(&self, p: Vec3, n: Vec3) -> usize {
        let place = place(p, n);
        let mut idx = 0;
        loop {
            let node = &self.nodes[idx];
            let Some(component) = place.get(node.axis as usize) else {
                return node.link as usize;
            };
            idx = if *component < node.split {
                idx + 1
            } else {
                node.link as usize
            };
        }
    }

    /// The two nodes below a node; none below a cell. The root is number 0.
    pub(crate) fn children(&self, node: usize) -> Option<[usize; 2]> {
        let Node { axis, link, .. } = self.nodes[node];
        (axis != CELL).then_some([node + 1, link as usize])
    }

    /// The first of the cells below a node: they have one number after the other.
    pub(crate) fn first_cell(&self, mut node: usize) -> usize {
        while let Some([first, _]) = self.children(node) {
            node = first;
        }
        self.nodes[node].link as usize
    }

    /// Bytes held.
    pub(crate) fn n_bytes(&self) -> usize {
        size_of_val(&self.nodes[..])
    }
}

/// A tree in the making.
struct Growing {
    tree: CellTree,
    members: Vec<Vec<u32>>,
}

impl Growing {
    fn divide(&mut self, places: &[Place], numbers: &mut [u32], capacity: usize) {
        let nodes = &mut self.tree.nodes;
        let idx = nodes.len();
        let Some((axis, split)) = choose_split(places, numbers, capacity) else {
            nodes.push(Node {
                axis: CELL,
                split: 0.0,
                link: self.members.len() as u32,
            });
            self.members.push(numbers.to_vec());
            return;
        };
        nodes.push(Node {
            axis: axis as u32,
            split,
            link: 0,
        });
        numbers.sort_by_key(|&number| places[number as usize][axis] >= split);
        let n_first = numbers.partition_point(|&number| places[number as usize][axis] < split);
        let (first, second) = numbers.split_at_mut(n_first);
        self.divide(places, first, capacity);
        self.tree.nodes[idx].link = self.tree.nodes.len() as u32;
        self.divide(places, second, capacity);
    }
}

/// Axis and value where a cell is divided: by the widest component of normals while they differ
/// much, else through the median of the widest component of positions while there are too many.
fn choose_split(places: &[Place], numbers: &[u32], capacity: usize) -> Option<(usize, f32)> {
    if numbers.len() < MIN_RECORDS.min(capacity + 1) {
        return None;
    }
    let mut min = [f32::INFINITY; 6];
    let mut max = [f32::NEG_INFINITY; 6];
    for &number in numbers {
        let place = places[number as usize];
        for axis in 0..6 {
            min[axis] = min[axis].min(place[axis]);
            max[axis] = max[axis].max(place[axis]);
        }
    }
    let extent = |axis: &usize| max[*axis] - min[*axis];
    let widest = |axes: std::ops::Range<usize>| {
        axes.max_by(|a, b| extent(a).total_cmp(&extent(b)))
            .expect("a range of axes")
    };
    let of_normals = widest(3..6);
    if extent(&of_normals) > MAX_NORMAL_EXTENT {
        return Some((of_normals, 0.5 * (min[of_normals] + max[of_normals])));
    }
    if numbers.len() <= capacity {
        return None;
    }
    let axis = widest(0..3);
    let mut components: Vec<f32> = numbers
        .iter()
        .map(|&number| places[number as usize][axis])
        .collect();
    let middle = components.len() / 2;
    let (_, &mut median, _) = components.select_nth_unstable_by(middle, f32::total_cmp);
    if median > min[axis] {
        return Some((axis, median));
    }
    // Half of the records or more are at the least component, on a plane: they are parted from the
    // others, if there are any.
    let beyond = components.into_iter().filter(|&c| c > min[axis]);
    beyond.min_by(f32::total_cmp).map(|nearest| (axis, nearest))
}

/// The place of a position and a normal.
#[inline]
pub(crate) fn place(p: Vec3, n: Vec3) -> Place {
    [p.x, p.y, p.z, n.x, n.y, n.z]
}
