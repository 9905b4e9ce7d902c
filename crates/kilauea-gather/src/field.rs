use kilauea_math::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::cell_tree::CellTree;
use crate::direction_tree::DirectionTree;
use crate::record::GatherRecord;

/// What is known of the light everywhere: where it comes from, cell by cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GatherField {
    tree: CellTree,
    directions: Vec<Option<DirectionTree>>,
}

/// Records of a cell per root of the number of all records: more records make cells both smaller
/// and better known (Müller et al. 2017, section 3.4).
const CELL_RECORDS_PER_ROOT: f32 = 4.0;
const MIN_RECORDS: f32 = 128.0;

impl GatherField {
    /// Fits a field to records. It depends on their order, and on nothing else; none where none is
    /// sound.
    pub fn fit(records: &[GatherRecord]) -> Option<Self> {
        let sound = GatherRecord::sound(records);
        if sound.is_empty() {
            return None;
        }
        let capacity = CELL_RECORDS_PER_ROOT * (sound.len() as f32).sqrt();
        let places = GatherRecord::places(&sound);
        let (tree, members) = CellTree::build(&places, capacity.max(MIN_RECORDS) as usize);
        let fit = |members: &Vec<u32>| {
            let numbers = members.iter().map(|&number| number as usize);
            DirectionTree::fit(numbers.map(|number| &sound[number].arrival))
        };
        Some(Self {
            directions: members.par_iter().map(fit).collect(),
            tree,
        })
    }

    /// Where light comes from at a position, in engine space, with a unit normal on the side that
    /// is seen. None where none came.
    #[inline]
    pub fn directions(&self, p: Vec3, n: Vec3) -> Option<&DirectionTree> {
        self.directions[self.cell(p, n)].as_ref()
    }

    /// Number of the cell of a position and a normal.
    #[inline]
    pub fn cell(&self, p: Vec3, n: Vec3) -> usize {
        self.tree.cell(p, n)
    }

    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        self.directions.len()
    }

    /// Bytes held.
    pub fn n_bytes(&self) -> usize {
        let trees = self.directions.iter().flatten();
        self.tree.n_bytes()
            + size_of_val(&self.directions[..])
            + trees.map(DirectionTree::n_bytes).sum::<usize>()
    }
}
