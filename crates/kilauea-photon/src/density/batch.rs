use kilauea_math::Bounds3;
use rayon::prelude::*;

use super::{DensityRule, Irradiance, SurfaceQuery};
use crate::PhotonMap;
use crate::morton::MortonGrid;

/// Queries that one thread takes at a time.
const QUERIES_PER_TASK: usize = 256;

impl PhotonMap {
    /// [`irradiance`](Self::irradiance) at many places, by all threads, in the order of the
    /// queries. They are worked off in Morton order, so that neighbours find the tree in the cache.
    pub fn irradiances(
        &self,
        queries: &[SurfaceQuery],
        radius: f32,
        rule: &DensityRule,
    ) -> Vec<Irradiance> {
        in_curve_order(queries, |query| self.irradiance(query, radius, rule))
    }
}

/// Answers in the order of the queries, which are asked in Morton order.
pub(crate) fn in_curve_order<A: Send>(
    queries: &[SurfaceQuery],
    ask: impl Fn(&SurfaceQuery) -> A + Sync,
) -> Vec<A> {
    let grid = MortonGrid::around(&Bounds3::from_points(queries.iter().map(|q| q.p)));
    let mut coded: Vec<(u64, u32)> = queries
        .par_iter()
        .zip(0_u32..queries.len() as u32)
        .map(|(query, i)| (grid.code(query.p), i))
        .collect();
    coded.par_sort_unstable();

    let mut answers: Vec<(u32, A)> = coded
        .into_par_iter()
        .with_min_len(QUERIES_PER_TASK)
        .map(|(_, i)| (i, ask(&queries[i as usize])))
        .collect();
    answers.par_sort_unstable_by_key(|&(i, _)| i);
    answers.into_iter().map(|(_, answer)| answer).collect()
}
