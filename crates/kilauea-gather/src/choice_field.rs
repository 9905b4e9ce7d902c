//! Which lights are worth choosing in each cell of a scene.

use kilauea_math::Vec3;
use serde::{Deserialize, Serialize};
use std::ops::Range;

use crate::cell_tree::{CellTree, place};
use crate::choice_record::{ChoiceRecord, ChoiceRecords, Turn};
use crate::picture::{MAX_RELATIVE_SQ, PictureEstimate};

/// How the ways of each fork are weighed in each cell, by what lights behind them brought
/// (Vévoda, Kondapaneni & Křivánek 2018, "Bayesian online regression for adaptive direct illumination
/// sampling", with another prior).
///
/// A choice of a light is a walk over forks, which come with probabilities of their own: by power and
/// distance, but blind to what is in between. Here each way is weighed by the root mean square of what
/// walks that took it brought, which leaves the least variance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChoiceField {
    tree: CellTree,
    /// Column of `odds` by the number of a fork.
    columns: Vec<u16>,
    n_columns: usize,
    /// What a second way brings over what the first does: `n_columns` for each cell.
    odds: Vec<f32>,
}

/// What is known of forks in one cell.
#[derive(Clone, Copy, Debug)]
pub struct CellChoice<'a> {
    columns: &'a [u16],
    odds: &'a [f32],
}

/// A fork without a column.
const UNKNOWN: u16 = u16::MAX;
/// Forks of fewer records are left as they are.
const LEAST_RECORDS: u32 = 16;
/// Columns at most: each takes memory in each cell.
const MOST_COLUMNS: usize = 1024;
/// Records of a cell at most. Few, as cells believe those around them.
const CELL_RECORDS: usize = 64;
/// Records' worth of belief that a part of a cell is as the whole.
const PRIOR_RECORDS: f32 = 16.0;
/// Odds are taken to be no more extreme, nor less than one over this.
const MOST_ODDS: f32 = 32.0;

/// How many walks took either way of a fork, and the squares of what they brought.
#[derive(Clone, Copy, Default)]
struct WaySums {
    n: [f32; 2],
    worth: [f32; 2],
}

/// Mean squares of what either way of a fork brings, column by column.
type Means = Vec<[f32; 2]>;

impl ChoiceField {
    /// Fits a field to records. It depends on their order, and on nothing else; none where none is
    /// sound.
    pub fn fit(records: &ChoiceRecords, picture: &PictureEstimate) -> Option<Self> {
        let sound = records.filter(ChoiceRecord::is_sound);
        if sound.is_empty() {
            return None;
        }
        let (columns, n_columns) = number_columns(&sound);
        let places: Vec<_> = sound
            .iter()
            .map(|record| place(record.p, record.n))
            .collect();
        let (tree, members) = CellTree::build(&places, CELL_RECORDS);
        let n_cells = members.len();
        let mut fit = Fit {
            walks: sound
                .iter()
                .map(|record| {
                    let relative = record.brought * picture.per_luminance(record.pixel);
                    (
                        sound.turns(record),
                        MAX_RELATIVE_SQ.min(relative * relative),
                    )
                })
                .collect(),
            tree: &tree,
            members: &members,
            columns: &columns,
            odds: vec![1.0; n_cells * n_columns],
        };
        let root_means = fit
            .sums(0..n_cells, n_columns)
            .iter()
            .map(|sums| {
                let [n, worth] = [sums.n, sums.worth].map(|[first, second]| first + second);
                [worth / n; 2]
            })
            .collect();
        fit.divide(0, 0..n_cells, &root_means);
        Some(Self {
            odds: fit.odds,
            tree,
            columns,
            n_columns,
        })
    }

    /// What is known at a position, in engine space, with a unit normal on the side that is seen.
    #[inline]
    pub fn at(&self, p: Vec3, n: Vec3) -> CellChoice<'_> {
        let first = self.cell(p, n) * self.n_columns;
        CellChoice {
            columns: &self.columns,
            odds: &self.odds[first..first + self.n_columns],
        }
    }

    /// Number of the cell of a position and a normal.
    #[inline]
    pub fn cell(&self, p: Vec3, n: Vec3) -> usize {
        self.tree.cell(p, n)
    }

    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        self.odds.len() / self.n_columns.max(1)
    }

    /// Bytes held.
    pub fn n_bytes(&self) -> usize {
        self.tree.n_bytes() + size_of_val(&self.columns[..]) + size_of_val(&self.odds[..])
    }
}

impl CellChoice<'_> {
    /// Probability of the first way of a fork, which has the probability `plain` where nothing is
    /// known.
    #[inline]
    pub fn first(&self, fork: u32, plain: f32) -> f32 {
        match self.columns.get(fork as usize) {
            Some(&column) if column != UNKNOWN => {
                plain / (plain + (1.0 - plain) * self.odds[column as usize])
            }
            _ => plain,
        }
    }

    /// Probability of turns over that which they have where nothing is known.
    pub(crate) fn ratio(&self, turns: &[Turn]) -> f32 {
        let of_turn = |turn: &Turn| {
            let first = self.first(turn.fork, turn.first);
            if turn.took_second {
                (1.0 - first) / (1.0 - turn.first)
            } else {
                first / turn.first
            }
        };
        turns.iter().map(of_turn).product()
    }
}

/// Numbers the forks of most records. Returns the column by fork, and how many there are.
fn number_columns(records: &ChoiceRecords) -> (Vec<u16>, usize) {
    let mut n_records: Vec<u32> = Vec::new();
    for turn in records.iter().flat_map(|record| records.turns(record)) {
        let fork = turn.fork as usize;
        if fork >= n_records.len() {
            n_records.resize(fork + 1, 0);
        }
        n_records[fork] += 1;
    }
    let mut forks: Vec<usize> = (0..n_records.len())
        .filter(|&fork| n_records[fork] >= LEAST_RECORDS)
        .collect();
    forks.sort_by_key(|&fork| std::cmp::Reverse(n_records[fork]));
    forks.truncate(MOST_COLUMNS);
    let mut columns = vec![UNKNOWN; n_records.len()];
    for (column, &fork) in (0..).zip(&forks) {
        columns[fork] = column;
    }
    (columns, forks.len())
}

/// A field in the making.
struct Fit<'a> {
    /// Turns of each record, and the square of what it brought relative to the picture.
    walks: Vec<(&'a [Turn], f32)>,
    tree: &'a CellTree,
    /// Numbers of the records of each cell.
    members: &'a [Vec<u32>],
    columns: &'a [u16],
    odds: Vec<f32>,
}

impl Fit<'_> {
    /// Fills the odds of cells below a node of the tree, by their records and by what is believed of
    /// the node above.
    fn divide(&mut self, node: usize, cells: Range<usize>, above: &Means) {
        let sums = self.sums(cells.clone(), above.len());
        let means: Means = sums
            .iter()
            .zip(above)
            .map(|(s, &above)| s.means(above))
            .collect();
        if let Some([first, second]) = self.tree.children(node) {
            let middle = self.tree.first_cell(second);
            self.divide(first, cells.start..middle, &means);
            self.divide(second, middle..cells.end, &means);
            return;
        }
        let row = &mut self.odds[cells.start * means.len()..][..means.len()];
        for (odds, [first, second]) in row.iter_mut().zip(means) {
            // Where neither brings anything, nothing is known.
            if first + second > 0.0 {
                let ratio = (second / first).sqrt();
                *odds = ratio.clamp(1.0 / MOST_ODDS, MOST_ODDS);
            }
        }
    }

    fn sums(&self, cells: Range<usize>, n_columns: usize) -> Vec<WaySums> {
        let mut sums = vec![WaySums::default(); n_columns];
        for &record in self.members[cells].iter().flatten() {
            let (turns, worth) = self.walks[record as usize];
            for turn in turns {
                let column = self.columns[turn.fork as usize];
                if let Some(sums) = sums.get_mut(column as usize) {
                    let way = usize::from(turn.took_second);
                    sums.n[way] += 1.0;
                    sums.worth[way] += worth;
                }
            }
        }
        sums
    }
}

impl WaySums {
    /// Means of both ways where the whole that this is a part of has the means `above`: each way is
    /// believed to be as there, but for the brightness that both share.
    fn means(&self, above: [f32; 2]) -> [f32; 2] {
        let prior = PRIOR_RECORDS * 0.5 * (above[0] + above[1]);
        let expected = self.n[0] * above[0] + self.n[1] * above[1];
        let brightness = (self.worth[0] + self.worth[1] + prior) / (expected + prior);
        // Where nothing was brought above, nothing was here.
        let brightness = if brightness.is_finite() {
            brightness
        } else {
            0.0
        };
        [0, 1].map(|way| {
            let believed = PRIOR_RECORDS * brightness * above[way];
            (self.worth[way] + believed) / (self.n[way] + PRIOR_RECORDS)
        })
    }
}
