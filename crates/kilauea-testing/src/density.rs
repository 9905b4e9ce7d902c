use std::collections::BTreeMap;

use crate::{Chi2, Domain, integrate, normal_two_sided};

/// Cells along each coordinate of a domain.
const N_CELLS: usize = 24;
/// Pieces along each side of a cell that seems empty.
const N_PIECES: usize = 8;
/// Error of the integral over a cell, in expected draws: far less than what chance adds.
const CELL_TOLERANCE: f64 = 0.3;
/// How much of the density quadrature and rounding may gain or lose in all.
const MASS_TOLERANCE: f64 = 1e-3;

/// What one draw gave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Draw<P> {
    /// A point with a density.
    At(P),
    /// One of a few points without a density, chosen with a stated probability.
    Atom {
        /// Which of them.
        idx: u32,
        /// Stated probability.
        probability: f64,
    },
    /// Nothing: the draw was lost.
    Lost,
}

/// How draws compare with the density that is stated for them.
#[derive(Clone, Copy, Debug)]
pub struct Comparison {
    /// Counts in cells of the domain, in each atom, and of what was lost, against expectations.
    pub chi2: Chi2,
    /// Integral of the density plus the probabilities of all atoms.
    pub mass: f64,
    /// Fraction of draws that gave something.
    pub kept: f64,
    n_draws: f64,
}

impl Comparison {
    /// How often draws from the stated density would be as far from it.
    ///
    /// Two tests, of all cells and of the total alone, which sees a factor on the density that all
    /// cells together drown in noise.
    pub fn p_value(&self) -> f64 {
        let smallest = self.chi2.p_value().min(self.mass_p_value());
        // Šidák's level for two.
        1.0 - (1.0 - smallest).powi(2)
    }

    fn mass_p_value(&self) -> f64 {
        let difference = (self.kept - self.mass).abs() - MASS_TOLERANCE;
        let variance = self.mass * (1.0 - self.mass) / self.n_draws;
        if difference <= 0.0 {
            1.0
        } else if variance <= 0.0 {
            0.0
        } else {
            normal_two_sided(difference / variance.sqrt())
        }
    }
}

/// Compares `n_draws` independent draws, each made for its number, with the density per measure of
/// the domain that is stated for them.
pub fn compare<D: Domain>(
    domain: &D,
    n_draws: u32,
    draw: impl Fn(u32) -> Draw<D::Point>,
    density: impl Fn(D::Point) -> f64,
) -> Comparison {
    let n = f64::from(n_draws);
    let mut counts = vec![0.0; N_CELLS * N_CELLS];
    let mut atoms: BTreeMap<u32, (f64, f64)> = BTreeMap::new();
    let mut n_lost = 0.0;
    for i in 0..n_draws {
        match draw(i) {
            Draw::At(point) => match domain.coordinates(point) {
                Some(at) => counts[cell_of(at)] += 1.0,
                None => n_lost += 1.0,
            },
            Draw::Atom { idx, probability } => {
                let (count, expected) = atoms.entry(idx).or_default();
                *count += 1.0;
                *expected = probability * n;
            }
            Draw::Lost => n_lost += 1.0,
        }
    }

    let mut expected_draws = |at| {
        let (point, measure) = domain.point(at);
        density(point) * measure * n
    };
    let mut cells: Vec<(f64, f64)> = counts
        .iter()
        .enumerate()
        .map(|(idx, &count)| {
            (
                count,
                expected_in_cell(idx, count > 0.0, &mut expected_draws),
            )
        })
        .collect();
    cells.extend(atoms.into_values());
    let mass = cells.iter().map(|(_, expected)| expected).sum::<f64>() / n;
    let lost = (1.0 - mass) * n;
    let is_all_kept = lost.abs() < MASS_TOLERANCE * n;
    if !is_all_kept || n_lost > 0.0 {
        cells.push((n_lost, lost.max(0.0)));
    }
    Comparison {
        chi2: Chi2::test(&cells),
        mass,
        kept: 1.0 - n_lost / n,
        n_draws: n,
    }
}

fn cell_of(at: [f64; 2]) -> usize {
    let [x, y] = at.map(|c| ((c * N_CELLS as f64) as usize).min(N_CELLS - 1));
    y * N_CELLS + x
}

/// Integrates over a cell; in pieces where the whole seems empty and is not.
fn expected_in_cell(idx: usize, is_reached: bool, f: &mut impl FnMut([f64; 2]) -> f64) -> f64 {
    let corner = [idx % N_CELLS, idx / N_CELLS];
    let edge = |i: usize| i as f64 / N_CELLS as f64;
    let (min, max) = (corner.map(edge), corner.map(|i| edge(i + 1)));
    let whole = integrate(min, max, CELL_TOLERANCE, f);
    if whole > 0.0 || !is_reached {
        return whole;
    }
    let size = 1.0 / (N_CELLS * N_PIECES) as f64;
    let pieces = (0..N_PIECES * N_PIECES).map(|i| [i % N_PIECES, i / N_PIECES]);
    pieces
        .map(|[x, y]| [min[0] + x as f64 * size, min[1] + y as f64 * size])
        .map(|min| integrate(min, min.map(|c| c + size), 0.1 * CELL_TOLERANCE, f))
        .sum()
}
