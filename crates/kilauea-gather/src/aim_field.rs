use std::ops::Range;

use kilauea_math::{Bounds3, Vec3};
use rayon::prelude::*;

use crate::cell_tree::CellTree;
use crate::direction_tree::DirectionTree;
use crate::directions::Directions;
use crate::record::GatherRecord;

/// Where to aim at: of light that arrives from few directions and only at some places, such as
/// caustics, the directions in cells around those places and in regions of many cells.
#[derive(Clone, Debug, PartialEq)]
pub struct AimField {
    tree: CellTree,
    cells: Vec<Cell>,
    /// The directions in each region.
    regions: Vec<DirectionTree>,
}

#[derive(Clone, Debug, PartialEq)]
struct Cell {
    /// None where there are too few records to tell.
    near: Option<Near>,
    /// Number of the region that it is in.
    region: u32,
}

/// What a cell says of places near its records.
#[derive(Clone, Debug, PartialEq)]
struct Near {
    /// Of the records, grown a little.
    bounds: Bounds3,
    directions: DirectionTree,
}

/// Records of a cell at most: as few as tell directions, so that cells are small and the light in
/// them comes from the same directions.
const CELL_RECORDS: usize = 96;
/// Fewer in a cell tell nothing.
const MIN_RECORDS: usize = 8;
/// Fewer in all do not tell places apart: a cell of them would reach over half a scene, and most of
/// what is aimed from there in vain.
const LEAST_RECORDS: usize = 4 * CELL_RECORDS;
/// Records of a region at least, if there are as many.
const REGION_RECORDS: usize = 8 * CELL_RECORDS;
/// Records are a part of what arrives: the box around them grows by this much of its diagonal.
const BOUNDS_GROWTH: f32 = 0.1;

impl AimField {
    /// Fits cells and regions to records. They depend on the records' order, and on nothing else;
    /// none where there are too few of them.
    pub fn fit(records: &[GatherRecord]) -> Option<Self> {
        let sound = GatherRecord::sound(records);
        if sound.len() < LEAST_RECORDS {
            return None;
        }
        let places = GatherRecord::places(&sound);
        let (tree, members) = CellTree::build(&places, CELL_RECORDS);
        let (cells_of_region, region_of_cell) = regions(&tree, &members);
        let fit_region =
            |cells: &Range<usize>| fit_directions(&sound, members[cells.clone()].iter().flatten());
        let regions = cells_of_region.par_iter().map(fit_region);
        let fit_cell = |(members, region): (&Vec<u32>, u32)| Cell {
            near: Near::fit(&sound, members),
            region,
        };
        let cells = members.par_iter().zip(region_of_cell).map(fit_cell);
        Some(Self {
            cells: cells.collect(),
            regions: regions.collect::<Option<_>>()?,
            tree,
        })
    }

    /// Directions to aim at from a position, in engine space, with a unit normal on the side that is
    /// seen.
    #[inline]
    pub fn directions(&self, p: Vec3, n: Vec3) -> Directions<'_> {
        let cell = &self.cells[self.tree.cell(p, n)];
        let near = cell.near.as_ref().filter(|near| near.reaches(p));
        Directions {
            near: near.map(|near| &near.directions),
            around: &self.regions[cell.region as usize],
        }
    }

    /// Number of cells with directions.
    pub fn n_cells(&self) -> usize {
        self.cells.iter().filter(|cell| cell.near.is_some()).count()
    }

    /// Bytes held.
    pub fn n_bytes(&self) -> usize {
        let near = self.cells.iter().filter_map(|cell| cell.near.as_ref());
        let directions = near.map(|near| &near.directions).chain(&self.regions);
        self.tree.n_bytes()
            + size_of_val(&self.cells[..])
            + size_of_val(&self.regions[..])
            + directions.map(DirectionTree::n_bytes).sum::<usize>()
    }
}

impl Near {
    fn fit(records: &[GatherRecord], members: &[u32]) -> Option<Self> {
        if members.len() < MIN_RECORDS {
            return None;
        }
        let places = members.iter().map(|&number| records[number as usize].p);
        let bounds = Bounds3::from_points(places);
        let growth = BOUNDS_GROWTH * bounds.diagonal().length();
        Some(Self {
            bounds: Bounds3 {
                min: bounds.min - growth,
                max: bounds.max + growth,
            },
            directions: fit_directions(records, members)?,
        })
    }

    #[inline]
    fn reaches(&self, p: Vec3) -> bool {
        let Bounds3 { min, max } = self.bounds;
        p.cmpge(min).all() && p.cmple(max).all()
    }
}

fn fit_directions<'a>(
    records: &[GatherRecord],
    members: impl IntoIterator<Item = &'a u32>,
) -> Option<DirectionTree> {
    let of_number = |&number: &u32| &records[number as usize].arrival;
    DirectionTree::fit(members.into_iter().map(of_number))
}

/// The cells of each region, and the number of the region of each cell: the least that it is in.
fn regions(tree: &CellTree, members: &[Vec<u32>]) -> (Vec<Range<usize>>, Vec<u32>) {
    let n_records = |cells: &Range<usize>| members[cells.clone()].iter().map(Vec::len).sum();
    let mut regions = Vec::new();
    let mut region_of_cell = vec![0; members.len()];
    let mut nodes = vec![(0, 0..members.len())];
    while let Some((node, cells)) = nodes.pop() {
        let n_records: usize = n_records(&cells);
        if n_records < REGION_RECORDS && !regions.is_empty() {
            continue;
        }
        // Nodes come after those that they are in.
        region_of_cell[cells.clone()].fill(regions.len() as u32);
        regions.push(cells.clone());
        if let Some([first, second]) = tree.children(node) {
            let middle = tree.first_cell(second);
            nodes.push((first, cells.start..middle));
            nodes.push((second, middle..cells.end));
        }
    }
    (regions, region_of_cell)
}
