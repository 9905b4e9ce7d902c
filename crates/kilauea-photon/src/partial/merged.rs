use std::num::NonZeroUsize;

use super::PartialMap;
use crate::density::irradiance_of_nearest;
use crate::{DensityRule, Irradiance, NearPhoton, SurfaceQuery};

/// An irradiance, and what it took to get it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Merged {
    /// From the `k` nearest photons of all parts together.
    pub irradiance: Irradiance,
    /// Photons that the parts have sent.
    pub n_sent: usize,
    /// Parts that were asked twice.
    pub n_asked_again: usize,
}

/// The `k` nearest of the `k` nearest of each part, which are those of one map.
pub fn merged<P: PartialMap>(
    parts: &[P],
    query: &SurfaceQuery,
    k: NonZeroUsize,
    max_radius: f32,
    rule: &DensityRule,
) -> Merged {
    let ask = |part: &P| part.nearest(query, k, max_radius, rule);
    let answers: Vec<Vec<NearPhoton>> = parts.iter().map(ask).collect();
    Merged {
        irradiance: irradiance_of_nearest(&all(&answers), k, max_radius, rule.kernel),
        n_sent: answers.iter().map(Vec::len).sum(),
        n_asked_again: 0,
    }
}

/// As [`merged`], with fewer photons sent: each part is asked for as many as it should have among
/// the nearest and three standard deviations more, k' = K / M + 3 √(K / M), and once more for all
/// `k` if those that it has not sent could be nearer than what came (the stopping rule of Fagin et
/// al. 2003, "Optimal Aggregation Algorithms for Middleware").
pub fn merged_in_rounds<P: PartialMap>(
    parts: &[P],
    query: &SurfaceQuery,
    k: NonZeroUsize,
    max_radius: f32,
    rule: &DensityRule,
) -> Merged {
    let k_first = k.min(expected_share(k, parts.len()));
    let mut answers: Vec<Vec<NearPhoton>> = parts
        .iter()
        .map(|part| part.nearest(query, k_first, max_radius, rule))
        .collect();
    let mut n_sent = answers.iter().map(Vec::len).sum();

    let reach_sq = all(&answers)
        .get(k.get() - 1)
        .map_or(max_radius * max_radius, |farthest| farthest.d_sq);
    let mut n_asked_again = 0;
    for (part, answer) in parts.iter().zip(&mut answers) {
        // A part that sent fewer than it was asked for has no more.
        let farthest_sent = answer.get(k_first.get() - 1);
        if k_first < k && farthest_sent.is_some_and(|photon| photon.d_sq < reach_sq) {
            *answer = part.nearest(query, k, max_radius, rule);
            n_sent += answer.len();
            n_asked_again += 1;
        }
    }
    Merged {
        irradiance: irradiance_of_nearest(&all(&answers), k, max_radius, rule.kernel),
        n_sent,
        n_asked_again,
    }
}

fn expected_share(k: NonZeroUsize, n_parts: usize) -> NonZeroUsize {
    let mean = k.get() as f64 / n_parts.max(1) as f64;
    NonZeroUsize::new((mean + 3.0 * mean.sqrt()).ceil() as usize).unwrap_or(NonZeroUsize::MIN)
}

/// All photons in ascending order of their distances; of equal ones that of the first part first.
fn all(answers: &[Vec<NearPhoton>]) -> Vec<NearPhoton> {
    let mut near = answers.concat();
    near.sort_by(|a, b| a.d_sq.total_cmp(&b.d_sq));
    near
}
