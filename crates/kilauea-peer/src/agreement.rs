use crate::{Query, RaySet, Tracer};

/// How far the answers of two tracers differ, counted in rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Agreement {
    /// Rays that the first tracer found to hit.
    pub n_hits: usize,
    /// Rays that one of the two found to hit.
    pub n_hit_by_one: usize,
    /// Rays whose hits are further apart than 1e-4 of their distance.
    pub n_other_distance: usize,
}

impl Agreement {
    /// The share of rays that may differ: tracers that are not watertight lose rays at edges, and
    /// surfaces that coincide or graze a ray come out in either order.
    pub const MAX_FRACTION: f64 = 1e-3;

    /// Compares two tracers ray by ray.
    pub fn of(a: &dyn Tracer, b: &dyn Tracer, set: &RaySet) -> Self {
        let mut agreement = Self::default();
        for ray in &set.rays {
            let [t_a, t_b] = match set.query {
                Query::Nearest => [a.nearest(ray), b.nearest(ray)],
                Query::NearestCoherent => [a.nearest_coherent(ray), b.nearest_coherent(ray)],
                Query::Any => [a, b].map(|tracer| tracer.occluded(ray).then_some(0.0)),
            };
            agreement.n_hits += usize::from(t_a.is_some());
            match (t_a, t_b) {
                (Some(a), Some(b)) if (a - b).abs() > 1e-4 * a.max(b) => {
                    agreement.n_other_distance += 1;
                }
                (Some(_), None) | (None, Some(_)) => agreement.n_hit_by_one += 1,
                _ => {}
            }
        }
        agreement
    }

    /// Whether no more of `n_rays` differ than [`Self::MAX_FRACTION`].
    pub fn is_within_tolerance(&self, n_rays: usize) -> bool {
        let n_differing = self.n_hit_by_one + self.n_other_distance;
        n_differing as f64 <= Self::MAX_FRACTION * n_rays as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Segment;
    use kilauea_math::Vec3;

    /// Hits every ray at one distance, or none.
    struct Everywhere(Option<f32>);

    impl Tracer for Everywhere {
        fn nearest(&self, _: &Segment) -> Option<f32> {
            self.0
        }

        fn occluded(&self, _: &Segment) -> bool {
            self.0.is_some()
        }
    }

    fn check(a: Option<f32>, b: Option<f32>, query: Query, expected: [usize; 3]) {
        let set = RaySet {
            kind: "test".into(),
            query,
            rays: vec![Segment::new(Vec3::ZERO, Vec3::X); 5],
        };
        let found = Agreement::of(&Everywhere(a), &Everywhere(b), &set);
        let counts = [found.n_hits, found.n_hit_by_one, found.n_other_distance];
        assert_eq!(counts, expected);
        assert_eq!(found.is_within_tolerance(5), expected[1..] == [0, 0]);
    }

    #[test]
    fn counts_rays_that_are_answered_differently() {
        check(Some(2.0), Some(2.0001), Query::Nearest, [5, 0, 0]);
        check(Some(2.0), Some(2.001), Query::Nearest, [5, 0, 5]);
        check(Some(2.0), Some(2.001), Query::Any, [5, 0, 0]);
        check(Some(2.0), None, Query::Nearest, [5, 5, 0]);
        check(None, Some(2.0), Query::Any, [0, 5, 0]);
        check(None, None, Query::Nearest, [0, 0, 0]);
    }
}
