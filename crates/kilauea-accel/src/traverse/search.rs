use super::keep::Keep;
use crate::ray::{Hit, PrimitiveId, Ray};

/// The best hit so far; before any, one that every hit in range wins over.
pub(crate) struct Search<F> {
    pub(crate) t_min: f32,
    pub(crate) best: Hit,
    /// The triangle that the ray starts on.
    pub(crate) from: PrimitiveId,
    keep: F,
}

impl<F: Keep> Search<F> {
    #[inline(always)]
    pub(crate) fn new(ray: &Ray, keep: F) -> Self {
        Self {
            t_min: ray.t_min.max(0.0),
            best: Hit {
                t: ray.t_max,
                u: 0.0,
                v: 0.0,
                primitive: u32::MAX,
                instance: u32::MAX,
            },
            from: ray.from,
            keep,
        }
    }

    /// Takes the hit if it wins.
    #[inline(always)]
    pub(crate) fn offer(&mut self, hit: Hit) -> bool {
        let better = hit.t > self.t_min && hit.wins_over(&self.best) && self.keep.keep(&hit);
        if better {
            self.best = hit;
        }
        better
    }
}
