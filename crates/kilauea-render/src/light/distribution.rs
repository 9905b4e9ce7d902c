//! Piecewise-constant density over the unit square.

use kilauea_math::Vec2;

/// A density over [0, 1)², constant in each cell of a grid.
#[derive(Clone, Debug)]
pub(super) struct Distribution2d {
    width: usize,
    height: usize,
    /// Cumulative weights of rows; `height + 1` values from 0 to 1.
    rows: Vec<f32>,
    /// Cumulative weights within each row; `width + 1` values from 0 to 1 a row.
    columns: Vec<f32>,
    /// Where to look in `rows`.
    row_guide: Vec<u32>,
    /// Where to look in each row of `columns`; `n_buckets(width) + 1` values a row.
    column_guides: Vec<u32>,
}

/// About so many cells are left to search once the guide was asked (Chen & Asau 1974, "On
/// Generating Random Variates from an Empirical Distribution"): a row of a large picture fills
/// many cache lines, of which halving it touches one a step.
const CELLS_PER_BUCKET: usize = 8;

impl Distribution2d {
    /// `weights` has `width * height` finite values ≥ 0, the row at y = 0 first, and a positive sum.
    pub(super) fn new(width: usize, height: usize, weights: &[f32]) -> Self {
        let mut columns = Vec::with_capacity((width + 1) * height);
        let sums: Vec<f64> = weights
            .chunks_exact(width)
            .map(|row| push_cumulative(row.iter().map(|&w| w as f64), &mut columns))
            .collect();
        let mut rows = Vec::with_capacity(height + 1);
        push_cumulative(sums.into_iter(), &mut rows);
        let mut row_guide = Vec::with_capacity(n_buckets(height) + 1);
        push_guide(&rows, &mut row_guide);
        let mut column_guides = Vec::with_capacity((n_buckets(width) + 1) * height);
        for row in columns.chunks_exact(width + 1) {
            push_guide(row, &mut column_guides);
        }
        Self {
            width,
            height,
            rows,
            columns,
            row_guide,
            column_guides,
        }
    }

    /// Bytes of its tables.
    pub(super) fn n_bytes(&self) -> usize {
        size_of_val(&*self.rows)
            + size_of_val(&*self.columns)
            + size_of_val(&*self.row_guide)
            + size_of_val(&*self.column_guides)
    }

    /// A point and its density.
    pub(super) fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let (y, in_row, pdf_y) = invert(&self.rows, &self.row_guide, u.y);
        let per_row = n_buckets(self.width) + 1;
        let column_guide = &self.column_guides[y * per_row..][..per_row];
        let (x, in_column, pdf_x) = invert(self.row(y), column_guide, u.x);
        let p = Vec2::new(
            (x as f32 + in_column) / self.width as f32,
            (y as f32 + in_row) / self.height as f32,
        );
        (p, pdf_x * pdf_y * (self.width * self.height) as f32)
    }

    /// Density at a point.
    pub(super) fn pdf(&self, p: Vec2) -> f32 {
        let cell = |x: f32, n: usize| ((x * n as f32) as usize).min(n - 1);
        let (x, y) = (cell(p.x, self.width), cell(p.y, self.height));
        let row = self.row(y);
        let mass = (row[x + 1] - row[x]) * (self.rows[y + 1] - self.rows[y]);
        mass * (self.width * self.height) as f32
    }

    fn row(&self, y: usize) -> &[f32] {
        &self.columns[y * (self.width + 1)..][..=self.width]
    }
}

/// Appends the normalised running sums, 0 first and 1 last; returns the total.
fn push_cumulative(weights: impl ExactSizeIterator<Item = f64> + Clone, out: &mut Vec<f32>) -> f64 {
    let n = weights.len();
    let total: f64 = weights.clone().sum();
    let mut sum = 0.0;
    out.push(0.0);
    for (i, weight) in weights.enumerate() {
        sum += weight;
        let fraction = if total > 0.0 {
            sum / total
        } else {
            (i + 1) as f64 / n as f64
        };
        out.push(fraction as f32);
    }
    total
}

/// Buckets of equal probability that guide into `n` cells. A power of two, so that the bucket of a
/// number is exact.
fn n_buckets(n: usize) -> usize {
    n.div_ceil(CELLS_PER_BUCKET).next_power_of_two()
}

/// Appends how many running sums are at most the lower end of each bucket, and at most 1.
fn push_guide(cumulative: &[f32], out: &mut Vec<u32>) {
    let n = n_buckets(cumulative.len() - 1);
    for bucket in 0..=n {
        let end = bucket as f32 / n as f32;
        out.push(cumulative.partition_point(|&c| c <= end) as u32);
    }
}

/// The cell whose range of running sums holds `u` in [0, 1), where in the cell, and the cell's
/// mass.
fn invert(cumulative: &[f32], guide: &[u32], u: f32) -> (usize, f32, f32) {
    let n = cumulative.len() - 1;
    let bucket = (u * (guide.len() - 1) as f32) as usize;
    let (begin, end) = (guide[bucket] as usize, guide[bucket + 1] as usize);
    let at_most_u = begin + cumulative[begin..end].partition_point(|&c| c <= u);
    let cell = at_most_u.clamp(1, n) - 1;
    let mass = cumulative[cell + 1] - cumulative[cell];
    let within = if mass > 0.0 {
        (u - cumulative[cell]) / mass
    } else {
        0.5
    };
    (cell, within.clamp(0.0, 1.0 - f32::EPSILON), mass)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_guide_finds_what_a_search_of_all_finds() {
        let weights = (0..100_u32).map(|i| f64::from(i * i % 17 * (i % 3)));
        let mut cumulative = Vec::new();
        push_cumulative(weights, &mut cumulative);
        let mut guide = Vec::new();
        push_guide(&cumulative, &mut guide);
        let ends = cumulative
            .iter()
            .flat_map(|&c| [c.next_down(), c, c.next_up()]);
        let between = (0..1000_u16).map(|i| f32::from(i) / 1000.0);
        for u in ends.chain(between).filter(|u| (0.0..1.0).contains(u)) {
            let all = cumulative.partition_point(|&c| c <= u).clamp(1, 100) - 1;
            assert_eq!(invert(&cumulative, &guide, u).0, all, "{u}");
        }
    }

    #[test]
    fn samples_follow_the_density() {
        let weights = [0.0, 1.0, 3.0, 0.0, 0.0, 0.0, 2.0, 2.0, 8.0];
        let d = Distribution2d::new(3, 3, &weights);
        let n = 300;
        let mut counts = [0.0; 9];
        for i in 0..n * n {
            let u = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32;
            let (p, pdf) = d.sample(u);
            let cell = (p.y * 3.0) as usize * 3 + (p.x * 3.0) as usize;
            counts[cell] += 1.0 / (n * n) as f32;
            assert!((pdf - d.pdf(p)).abs() < 1e-4);
        }
        for (count, weight) in counts.iter().zip(&weights) {
            assert!((count - weight / 16.0).abs() < 2e-3, "{count} {weight}");
        }
    }
}
