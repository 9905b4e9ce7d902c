use kilauea_math::{Bounds3, Vec3};
use rayon::prelude::*;

use crate::cell_tree::CellTree;
use crate::direction_tree::DirectionTree;
use crate::record::GatherRecord;

/// Where to aim at: of light that arrives from few directions and only at some places, such as
/// caustics, the directions in cells around those places.
///
/// Unlike in a [`crate::GatherField`], nothing is said of places where no record is near.
#[derive(Clone, Debug, PartialEq)]
pub struct AimField {
    tree: CellTree,
    cells: Vec<Option<Cell>>,
}

#[derive(Clone, Debug, PartialEq)]
struct Cell {
    /// Of its records, grown a little.
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
/// Records are a part of what arrives: the box around them grows by this much of its diagonal.
const BOUNDS_GROWTH: f32 = 0.1;

impl AimField {
    /// Fits cells to records. They depend on the records' order, and on nothing else; none where
    /// there are too few of them.
    pub fn fit(records: &[GatherRecord]) -> Option<Self> {
        let sound = GatherRecord::sound(records);
        if sound.len() < LEAST_RECORDS {
            return None;
        }
        let places = GatherRecord::places(&sound);
        let (tree, members) = CellTree::build(&places, CELL_RECORDS);
        let fit = |members: &Vec<u32>| Cell::fit(&sound, members);
        let cells: Vec<Option<Cell>> = members.par_iter().map(fit).collect();
        let has_any = cells.iter().any(Option::is_some);
        has_any.then_some(Self { tree, cells })
    }

    /// Directions to aim at from a position, in engine space, with a unit normal on the side that is
    /// seen. None where no record is near.
    #[inline]
    pub fn directions(&self, p: Vec3, n: Vec3) -> Option<&DirectionTree> {
        let cell = self.cells[self.tree.cell(p, n)].as_ref()?;
        let Bounds3 { min, max } = cell.bounds;
        (p.cmpge(min).all() && p.cmple(max).all()).then_some(&cell.directions)
    }

    /// Number of cells with directions.
    pub fn n_cells(&self) -> usize {
        self.cells.iter().flatten().count()
    }

    /// Bytes held.
    pub fn n_bytes(&self) -> usize {
        let cells = self.cells.iter().flatten();
        self.tree.n_bytes()
            + size_of_val(&self.cells[..])
            + cells.map(|cell| cell.directions.n_bytes()).sum::<usize>()
    }
}

impl Cell {
    fn fit(records: &[GatherRecord], members: &[u32]) -> Option<Self> {
        if members.len() < MIN_RECORDS {
            return None;
        }
        let members = || members.iter().map(|&number| &records[number as usize]);
        let bounds = Bounds3::from_points(members().map(|record| record.p));
        let growth = BOUNDS_GROWTH * bounds.diagonal().length();
        Some(Self {
            bounds: Bounds3 {
                min: bounds.min - growth,
                max: bounds.max + growth,
            },
            directions: DirectionTree::fit(members().map(|record| &record.arrival))?,
        })
    }
}
