use crate::functions::chi2_survival;

/// Least expectation of a cell; those with less are pooled (Cochran 1954).
const MIN_EXPECTED: f64 = 5.0;

/// Pearson's test of counts against their expectations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chi2 {
    /// Σ (count − expected)² / expected.
    pub statistic: f64,
    /// One less than the cells that were left after pooling.
    pub degrees_of_freedom: f64,
}

impl Chi2 {
    /// Compares counts with expectations that add up to the same.
    ///
    /// Cells that expect little are pooled into one, the least first, until that is large enough.
    /// One that never is counts as if it were, which lets no count pass where none is expected.
    pub fn test(cells: &[(f64, f64)]) -> Self {
        let mut cells = cells.to_vec();
        cells.sort_by(|(_, a), (_, b)| a.total_cmp(b));
        let mut pool = (0.0, 0.0);
        let mut n_pooled = 0;
        for &(count, expected) in &cells {
            if expected >= MIN_EXPECTED || pool.1 >= MIN_EXPECTED {
                break;
            }
            pool.0 += count;
            pool.1 += expected;
            n_pooled += 1;
        }
        let kept = &cells[n_pooled..];
        let term = |&(count, expected): &(f64, f64)| {
            (count - expected).powi(2) / f64::max(expected, MIN_EXPECTED)
        };
        let n_cells = kept.len() + usize::from(pool.1 > 0.0);
        Self {
            statistic: kept.iter().map(term).sum::<f64>() + term(&pool),
            degrees_of_freedom: n_cells.saturating_sub(1) as f64,
        }
    }

    /// How often sound counts would be as far off.
    pub fn p_value(&self) -> f64 {
        if self.degrees_of_freedom > 0.0 {
            chi2_survival(self.statistic, self.degrees_of_freedom)
        } else if self.statistic < 1.0 {
            // One cell holds all, as it must.
            1.0
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_textbook_die() {
        // 600 throws.
        let counts = [92.0, 108.0, 105.0, 87.0, 113.0, 95.0];
        let cells = counts.map(|count| (count, 100.0));
        let chi2 = Chi2::test(&cells);
        assert!((chi2.statistic - 5.16).abs() < 1e-12);
        assert_eq!(chi2.degrees_of_freedom, 5.0);
        assert!((chi2.p_value() - 0.3966).abs() < 1e-3, "{}", chi2.p_value());
    }

    #[test]
    fn small_cells_are_pooled_until_they_are_large() {
        let cells = [(3.0, 2.0), (0.0, 1.0), (1.0, 2.5), (12.0, 10.0), (4.0, 4.5)];
        let chi2 = Chi2::test(&cells);
        // 1 + 2 + 2.5 are enough for a cell; 4.5 stands alone.
        assert_eq!(chi2.degrees_of_freedom, 2.0);
        let expected = 1.5_f64.powi(2) / 5.5 + 0.5_f64.powi(2) / 5.0 + 0.4;
        assert!((chi2.statistic - expected).abs() < 1e-12);
    }

    #[test]
    fn counts_where_none_may_be_are_seen() {
        let mut cells = vec![(100.0, 100.0); 20];
        cells.push((60.0, 0.0));
        assert!(Chi2::test(&cells).p_value() < 1e-4);
        assert_eq!(Chi2::test(&[(5.0, 0.0)]).p_value(), 0.0);
        assert!(Chi2::test(&[(100.0, 100.0), (30.0, 2.0)]).p_value() < 1e-6);
        assert_eq!(Chi2::test(&[(100.0, 100.0), (0.0, 0.0)]).p_value(), 1.0);
    }
}
