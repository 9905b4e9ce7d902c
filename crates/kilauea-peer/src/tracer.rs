use crate::Segment;

/// What is asked of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Query {
    /// Where the nearest hit is.
    Nearest,
    /// Where the nearest hit is, of rays that go much like those before them.
    NearestCoherent,
    /// Whether anything is hit.
    Any,
}

/// What a batch of rays found: enough that no tracer's work can be optimised away.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Rays that hit something.
    pub n_hits: usize,
    /// Sum of the distances of nearest hits.
    pub t_sum: f64,
}

/// A tree over one mesh, and how rays are traced through it.
pub trait Tracer {
    /// Distance of the nearest hit.
    fn nearest(&self, ray: &Segment) -> Option<f32>;

    /// Distance of the nearest hit of a ray that goes much like the one before.
    #[inline(always)]
    fn nearest_coherent(&self, ray: &Segment) -> Option<f32> {
        self.nearest(ray)
    }

    /// Whether anything is hit.
    fn occluded(&self, ray: &Segment) -> bool;

    /// Traces rays one by one. Each tracer has a copy of this loop with its own calls in it.
    fn trace(&self, rays: &[Segment], query: Query) -> Tally {
        let mut tally = Tally::default();
        match query {
            Query::Nearest => {
                for t in rays.iter().filter_map(|ray| self.nearest(ray)) {
                    tally.n_hits += 1;
                    tally.t_sum += f64::from(t);
                }
            }
            Query::NearestCoherent => {
                for t in rays.iter().filter_map(|ray| self.nearest_coherent(ray)) {
                    tally.n_hits += 1;
                    tally.t_sum += f64::from(t);
                }
            }
            Query::Any => {
                for ray in rays {
                    tally.n_hits += usize::from(self.occluded(ray));
                }
            }
        }
        tally
    }
}
