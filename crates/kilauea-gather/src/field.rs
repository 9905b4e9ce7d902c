use kilauea_math::Vec3;
use rayon::prelude::*;

use crate::cell_tree::CellTree;
use crate::direction_tree::DirectionTree;
use crate::record::GatherRecord;
use crate::reflection::Reflection;

/// What is known of the light everywhere.
#[derive(Clone, Debug, PartialEq)]
pub struct GatherField {
    directions: Cells<Option<DirectionTree>>,
    reflections: Cells<Reflection>,
}

/// A value for each cell.
#[derive(Clone, Debug, PartialEq)]
struct Cells<T> {
    tree: CellTree,
    values: Vec<T>,
}

/// Records of a cell per root of the number of all records: more records make cells both smaller
/// and better known (Müller et al. 2017, section 3.4).
const CELL_RECORDS_PER_ROOT: f32 = 4.0;
const MIN_DIRECTION_RECORDS: f32 = 128.0;
/// A mean takes fewer records than a distribution.
const REFLECTION_RECORDS: usize = 256;

impl GatherField {
    /// Fits a field to records. It depends on their order, and on nothing else; none where none is
    /// sound.
    pub fn fit(records: &[GatherRecord]) -> Option<Self> {
        let sound: Vec<GatherRecord> = records
            .iter()
            .copied()
            .filter(GatherRecord::is_sound)
            .collect();
        if sound.is_empty() {
            return None;
        }
        let capacity = CELL_RECORDS_PER_ROOT * (sound.len() as f32).sqrt();
        let capacity = capacity.max(MIN_DIRECTION_RECORDS) as usize;
        Some(Self {
            directions: Cells::fit(&sound, capacity, |members| {
                DirectionTree::fit(members.iter().copied())
            }),
            reflections: Cells::fit(&sound, REFLECTION_RECORDS, Reflection::fit),
        })
    }

    /// Where light comes from at a position, in engine space, with a unit normal on the side that
    /// is seen. None where none came.
    #[inline]
    pub fn directions(&self, p: Vec3, n: Vec3) -> Option<&DirectionTree> {
        self.directions.at(p, n).as_ref()
    }

    /// What surfaces at a position, with a normal, reflect.
    #[inline]
    pub fn reflection(&self, p: Vec3, n: Vec3) -> &Reflection {
        self.reflections.at(p, n)
    }

    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        self.directions.values.len()
    }

    /// Bytes held.
    pub fn n_bytes(&self) -> usize {
        let trees = self.directions.values.iter().flatten();
        self.directions.n_bytes()
            + self.reflections.n_bytes()
            + trees.map(DirectionTree::n_bytes).sum::<usize>()
    }
}

impl<T: Send> Cells<T> {
    fn fit(
        records: &[GatherRecord],
        capacity: usize,
        fit: impl Fn(&[&GatherRecord]) -> T + Sync,
    ) -> Self {
        let (tree, members) = CellTree::build(records, capacity);
        let fit = |members: &Vec<u32>| {
            let of_cell: Vec<&GatherRecord> = members
                .iter()
                .map(|&number| &records[number as usize])
                .collect();
            fit(&of_cell)
        };
        Self {
            tree,
            values: members.par_iter().map(fit).collect(),
        }
    }

    #[inline]
    fn at(&self, p: Vec3, n: Vec3) -> &T {
        &self.values[self.tree.cell(p, n)]
    }

    fn n_bytes(&self) -> usize {
        self.tree.n_bytes() + size_of_val(&self.values[..])
    }
}
